"""How a way through the air is searched for: the space of a leg's postures, and what looks for a path in it."""
