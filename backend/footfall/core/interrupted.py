"""Interrupts (Ctrl-C) that compiled code wraps in errors of its own."""


def came_of_interrupt(error: BaseException | None) -> bool:
    """Whether an error came of an interrupt: numba makes a SystemError of one that arrives while it is called."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
