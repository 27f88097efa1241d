"""The command line, called in this process or started as one of its own."""

import sys

from typer.testing import CliRunner

from footfall.cli import app

FOOTFALL = [sys.executable, "-c", "from footfall.cli import main; main()"]
"""Begins a command for subprocess."""


def run(*arguments: object, code: int = 0):
    """What the command says, after it ended with this exit code."""
    result = CliRunner().invoke(app, [str(one) for one in arguments])
    assert result.exit_code == code, result.output
    return result
