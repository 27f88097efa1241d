"""Ctrl-C while compiled code runs."""

import pytest
import typer
from typer.testing import CliRunner

from footfall.cli.terminal import Reporting


@pytest.mark.parametrize(("cause", "code"), [(KeyboardInterrupt(), 130), (ValueError(), 1)])
def test_an_interrupt_that_compiled_code_wraps_ends_the_program_as_any_other(cause, code):
    app = typer.Typer(cls=Reporting)

    @app.command("plan")
    def plan():
        raise SystemError("returned a result with an exception set") from cause

    @app.command("map")
    def other():
        pass

    ended = CliRunner().invoke(app, ["plan"])
    assert ended.exit_code == code
    assert isinstance(ended.exception, SystemExit if code == 130 else SystemError)
