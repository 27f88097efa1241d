"""The files of the page, packed once: a browser asks for more than a hundred of them before it shows anything."""

import gzip
import os
import stat
from functools import lru_cache
from pathlib import Path
from typing import Any

from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

LEAST = 500
"""What is smaller is not worth packing [bytes]."""
MOST_KEPT = 512
"""Packed files that are kept; more than the page has."""


class PageFiles(StaticFiles):
    """The operator's page. The browser asks each time whether a file is still the same."""

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
        return self.file_response(full_path, stat_result, scope)

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
