"""Mutation testing of the modules in which a wrong green is worst: what their tests let pass."""
