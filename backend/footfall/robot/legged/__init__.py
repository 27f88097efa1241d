"""Legged robots that others described: their tree of links and joints, what in it is a leg, and what is doubtful."""
