"""Progress of long work, and the wish to stop it, handed down as one argument.

Pure code calls ``progress(fraction, text)`` at natural pauses. The receiver records it and raises
:class:`~footfall.core.errors.Cancelled` where the work is to stop; the code lets it pass through.
"""

from collections.abc import Callable

from footfall.core.value import Value

Progress = Callable[[float, str], None]
"""fraction in 0…1, and what is being done, for a person."""


def no_progress(fraction: float, text: str) -> None:
    """For callers that neither watch nor cancel."""


def part(progress: Progress, start: float, end: float) -> Progress:
    """A progress whose 0…1 is a part of another's.

    Args:
        progress: the other.
        start: its fraction where this one is at 0.
        end: its fraction where this one is at 1.

    Returns:
        The progress to report to.
    """

    def report(fraction: float, text: str) -> None:
        progress(start + (end - start) * fraction, text)

    return report


def preview_of(progress: Progress) -> Callable[[Value], None]:
    """Where to show a coarse form of a product before it is done; what is shown there is looked at, never kept.

    A receiver that shows previews has a method ``preview(product)``; without one, nothing happens.
    """
    return getattr(progress, "preview", _nobody_looks)


def _nobody_looks(product: Value) -> None:
    """For receivers that show no previews."""
