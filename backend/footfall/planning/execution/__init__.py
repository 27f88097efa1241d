"""What is commanded so that the predicted motion of the yielding rover is the planned one."""
