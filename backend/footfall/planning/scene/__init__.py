"""The rover on its ground, as every planner asks about it: what is near, what is clear, what a leg reaches."""
