"""The simulated rover: how it moves, what its cameras see, and its end of the rover link."""
