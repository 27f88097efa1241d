"""A session over REST whose server, workers and rover are killed at random points, and what of it must be left."""
