"""One limb of any robot: its chain of joints, and the angles that bring its foot to a place."""
