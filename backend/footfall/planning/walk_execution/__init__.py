"""A walk as a yielding rover makes it: executions of its moves and steps, each from where the one before ends."""
