"""Logs: one JSON object a line in a file of the working folder that rotates, and lines for people on stderr.

Whoever logs goes on to say ``logging.getLogger(__name__).warning(…)``; what is bound with ``structlog.contextvars``
(``request``, ``session``, ``job``) stands in every line, also in those of other libraries.
"""

import logging
import re
import sys
from collections.abc import MutableMapping
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any

import structlog

FOLDER, FILE = "logs", "footfall.jsonl"
FILE_BYTES = 10 << 20
"""A file that has grown to this is put aside …"""
FILES_KEPT = 5
"""… and so many of those are kept."""
MOST_FRAMES = 50
"""Of an exception, in the file."""
HIDDEN = "[hidden]"
_SECRET_NAME = re.compile(r"(?i)token|secret|password|passwd|authorization|cookie|api[-_]?key")
_SECRET_TEXT = re.compile(
    r"(?i)(\b(?:bearer|basic)\s+|\b(?:[\w-]*(?:token|secret|password|authorization|cookie|api[-_]?key))"
    r"""["']?\s*[=:]\s*["']?(?:(?:bearer|basic)\s+)?)[^\s"'&,;}\])]+"""
)


def start_logging(folder: Path | None, *, level: int = logging.INFO) -> None:
    """From now on everything of ``level`` and above goes into ``folder``/logs, and warnings to stderr too.

    folder: None: no file. A file that can't be written is told on stderr, and the work goes on without it.
    """
    root = logging.getLogger()
    for old in [one for one in root.handlers if getattr(one, "of_footfall", False)]:
        root.removeHandler(old)
        old.close()
    people = _ForPeople(logging.WARNING)
    plain = structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty(), exception_formatter=structlog.dev.plain_traceback)
    people.setFormatter(_formatter(plain, structlog.processors.format_exc_info))
    _add(root, people)
    root.setLevel(level)
    # these tell of every request at INFO
    for chatty in ("uvicorn", "httpx", "websockets", "PIL", "matplotlib"):
        logging.getLogger(chatty).setLevel(logging.WARNING)
    if folder is not None:
        try:
            (folder / FOLDER).mkdir(parents=True, exist_ok=True)
            file = _File(folder / FOLDER / FILE, maxBytes=FILE_BYTES, backupCount=FILES_KEPT, encoding="utf-8")
        except OSError as error:
            logging.getLogger(__name__).warning("nothing is logged to a file: %s", error)
        else:
            file.setFormatter(_formatter(structlog.processors.JSONRenderer(), _as_data))
            _add(root, file)


class _File(RotatingFileHandler):
    """A file that may not take lines for a while, as where its disk is full. That is told once, and once that it does.

    logging itself would write each such line to stderr with what led there, secrets included.
    """

    _refused = 0

    def emit(self, record: logging.LogRecord) -> None:
        before = self._refused
        super().emit(record)
        if before and self._refused == before:
            self._refused = 0
            self._tell(f"the log file takes lines again; {before} of them were refused, and may be missing")

    def handleError(self, record: logging.LogRecord) -> None:
        """See logging.Handler."""
        self._refused += 1
        if self._refused == 1:
            self._tell(f"the log file takes no lines, and the work goes on without them: {sys.exc_info()[1]}")

    def _tell(self, text: str) -> None:
        print(text, file=sys.stderr, flush=True)  # noqa: T201


class _ForPeople(logging.Handler):
    """Lines on stderr as it is at that moment: it may have been redirected since."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            print(self.format(record), file=sys.stderr, flush=True)  # noqa: T201
        except Exception:
            self.handleError(record)


def _add(root: logging.Logger, handler: logging.Handler) -> None:
    handler.of_footfall = True  # type: ignore[attr-defined]
    root.addHandler(handler)


# without what stood in the frames: to put that into words takes seconds in which no stop is heard, and it holds secrets
_as_data = structlog.processors.ExceptionRenderer(
    structlog.tracebacks.ExceptionDictTransformer(show_locals=False, max_frames=MOST_FRAMES)
)


def _formatter(renderer: Any, told_exception: Any) -> structlog.stdlib.ProcessorFormatter:
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=[
            structlog.contextvars.merge_contextvars,
            structlog.stdlib.add_log_level,
            structlog.stdlib.add_logger_name,
            structlog.stdlib.ExtraAdder(),
            _once,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
        ],
        processors=[
            structlog.stdlib.ProcessorFormatter.remove_processors_meta,
            told_exception,
            without_secrets,
            renderer,
        ],
    )


def _once(_: Any, __: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Another handler may have left the text in the record, as if it were something to add."""
    event.pop("message", None)
    return event


def without_secrets(_: Any, __: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """A processor that hides what is named like a secret, and what stands behind such a name in a text."""
    for name, content in event.items():
        if isinstance(content, str):
            event[name] = HIDDEN if _SECRET_NAME.search(name) else _SECRET_TEXT.sub(rf"\g<1>{HIDDEN}", content)
        elif name != "exc_info" and _SECRET_NAME.search(name):
            event[name] = HIDDEN
        elif isinstance(content, (dict, list)):
            event[name] = _within(content)
    return event


def _within(content: Any) -> Any:
    if isinstance(content, dict):
        return {
            name: HIDDEN if isinstance(name, str) and _SECRET_NAME.search(name) else _within(one)
            for name, one in content.items()
        }
    if isinstance(content, list):
        return [_within(one) for one in content]
    return _SECRET_TEXT.sub(rf"\g<1>{HIDDEN}", content) if isinstance(content, str) else content
