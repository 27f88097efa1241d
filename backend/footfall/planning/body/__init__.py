"""Standing, and moves of the chassis while all wheels stand."""
