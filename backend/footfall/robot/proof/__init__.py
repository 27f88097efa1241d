"""The compiled proof that a leg touches nothing, and that it surely does, by convex shells, balls and tables."""
