"""Walks on generated terrains of several families: ``python -m benchmarks.walks``."""
