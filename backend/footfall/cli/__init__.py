"""The command line: a module for each group of commands, all of them joined in ``program``."""

from footfall.cli.program import app, main

__all__ = ["app", "main"]
