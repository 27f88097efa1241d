"""Stances, steps and walks of robots that others described: legs of any build that end in balls, points or discs."""
