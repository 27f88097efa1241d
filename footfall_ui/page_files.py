"""The files of the page, packed once. What a page begins with comes joined with all that it imports: for each file by
itself a browser would ask more than a hundred times before it shows anything, layer by layer.
"""

import gzip
import hashlib
import mimetypes
import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope

from footfall.io.joined_files import joined_module, joined_style

JOINED = {
    "page.js": joined_module,
    "page.css": joined_style,
    "loginpage.js": joined_module,
    "loginpage.css": joined_style,
}
"""Files that come joined with what they import, and how."""

LEAST = 500
"""What is smaller is not worth packing [bytes]."""
MOST_KEPT = 512
"""Packed files that are kept; more than the page has."""


@dataclass(frozen=True)
class _Whole:
    """A file with all that it imports. written: when each of them was written last [ns]."""

    written: dict[Path, int]
    plain: bytes
    packed: bytes
    tag: str


class PageFiles(StaticFiles):
    """The operator's page. The browser asks each time whether a file is still the same."""

    def __init__(self, **where: Any) -> None:
        super().__init__(**where)
        self._wholes: dict[Path, _Whole] = {}

    async def get_response(self, path: str, scope: Scope) -> Any:
        answer = self._found(path, scope) or await super().get_response(path, scope)
        answer.headers["Cache-Control"] = "no-cache"
        return answer

    def _found(self, path: str, scope: Scope) -> Response | None:
        """A file, looked up here: going to another thread, as is done for disks far away, takes longer than that."""
        if scope["method"] not in ("GET", "HEAD"):
            return None
        try:
            full_path, stat_result = self.lookup_path(path)
        except (OSError, ValueError):
            return None
        if stat_result is None or not stat.S_ISREG(stat_result.st_mode):
            return None
        if Path(full_path).name in JOINED:
            return self._joined(Path(full_path), scope)
        return self.file_response(full_path, stat_result, scope)

    def _joined(self, entry: Path, scope: Scope) -> Response:
        """A file with all that it imports, joined anew where one of them has changed."""
        whole = self._wholes.get(entry)
        if whole is None or whole.written != _written(whole.written):
            whole = self._wholes[entry] = _whole(entry)
        asked, kind = Headers(scope=scope), mimetypes.guess_type(entry.name)[0]
        packed = "gzip" in asked.get("Accept-Encoding", "")
        headers = {"ETag": whole.tag, "Vary": "Accept-Encoding"} | ({"Content-Encoding": "gzip"} if packed else {})
        answer = Response(whole.packed if packed else whole.plain, headers=headers, media_type=kind)
        return NotModifiedResponse(answer.headers) if self.is_not_modified(answer.headers, asked) else answer

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        plain = super().file_response(full_path, stat_result, scope, status_code)
        plain.headers["Vary"] = "Accept-Encoding"
        takes = Headers(scope=scope).get("Accept-Encoding", "")
        if not isinstance(plain, FileResponse) or "gzip" not in takes or stat_result.st_size < LEAST:
            return plain
        headers = dict(plain.headers) | {"Content-Encoding": "gzip"}
        del headers["content-length"], headers["accept-ranges"]
        return Response(_packed(Path(full_path), stat_result.st_mtime_ns), status_code, headers)


@lru_cache(MOST_KEPT)
def _packed(path: Path, _written: int) -> bytes:
    """What a file holds; ``_written``: when it was written last, so that a changed one is read anew."""
    return gzip.compress(path.read_bytes(), 6)


def _whole(entry: Path) -> _Whole:
    joined = JOINED[entry.name](entry)
    plain = joined.text.encode()
    tag = f'"{hashlib.sha256(plain).hexdigest()[:16]}"'
    return _Whole(_written(joined.files), plain, gzip.compress(plain, 6), tag)


def _written(files: Iterable[Path]) -> dict[Path, int]:
    return {file: file.stat().st_mtime_ns for file in files}
