"""Sessions on disk: logs in a database, the head of each log in a file of its own, artifacts by digest."""
