"""Long runs that may be stopped and gone on with: a file keeps what each part gave, a line of JSON a part."""

import hashlib
import json
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from footfall.core.errors import InvalidInput

HERE = Path(__file__).parent


class KeptRun:
    """about: what every part hangs on, such as seed and code; the file's first line.

    Begins the file where there is none. Raises InvalidInput where it is about something else.
    """

    def __init__(self, path: Path, about: Mapping[str, Any]) -> None:
        self._path = path
        if not path.exists():
            path.write_text(json.dumps(about) + "\n")
        lines = path.read_text().splitlines(keepends=True)
        if not lines or json.loads(lines[0]) != about:
            raise InvalidInput("this state is of another seed or other code: begin another", state=str(path))
        if not lines[-1].endswith("\n"):
            lines.pop()  # it was stopped while it wrote this part
            path.write_text("".join(lines))
        self.parts: list[dict[str, Any]] = [json.loads(line) for line in lines[1:]]

    def add(self, part: Mapping[str, Any]) -> None:
        with self._path.open("a") as file:
            file.write(json.dumps(part) + "\n")


def digest_of(footfall: Iterable[str], benchmarks: Iterable[str]) -> str:
    """Of the source in files and folders of the package, and of files beside this one."""
    digest = hashlib.sha256()
    package = Path(str(files("footfall")))
    paths = [package / name for name in footfall]
    sources = [source for path in paths for source in (path.rglob("*.py") if path.is_dir() else (path,))]
    for source in sorted([*sources, *(HERE / name for name in benchmarks)]):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]
