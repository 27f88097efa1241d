"""``njit`` that keeps what it compiled, and makes it anew when anything changed that it was compiled with.

numba keeps a compiled function beside its source and makes it anew when that file changes. What the function calls and
the constants that it uses are part of the compiled code wherever they come from: of a changed one the old state would
go on being used, and a posture be called free that is not. So what is kept here is marked with the content of the
function's file and of every file of its package that this one imports, one through another.
"""

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

_IMPORT = re.compile(r"^(?:from ([\w.]+) import (\([^)]*\)|.*)|import ([\w.]+))", re.MULTILINE)

F = TypeVar("F", bound=Callable[..., Any])


def njit(**options: Any) -> Callable[[F], F]:
    """As numba's, with its options, of a function at the top of a module; kept on disk.

    Without numba's second way in, for programs in C: nobody takes it, and it takes long to compile.
    """
    options["no_cfunc_wrapper"] = True

    def compiled(function: F) -> F:
        made: Any = numba.njit(**options)(function)
        made._cache = _Kept(function)
        return made

    return compiled


class _Kept(FunctionCache):
    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        path, module = Path(function.__code__.co_filename).resolve(), function.__module__
        made_of = _content(path, path.parents[module.count(".")], module.partition(".")[0])
        self._cache_file = IndexDataCacheFile(self._cache_path, self._impl.filename_base, made_of)
        # asked before what is kept is unpickled: that may name classes that are no more
        self._cache_file._version = f"{numba.__version__} {made_of}"


@cache
def _content(path: Path, root: Path, package: str) -> str:
    """Digest of a file and of all that it imports of its package, which lies in ``root``."""
    found, open_yet = set[Path](), [path]
    while open_yet:
        if (one := open_yet.pop()) not in found:
            found.add(one)
            open_yet += _imported(one, root, package)
    digest = hashlib.sha256()
    for one in sorted(found):
        digest.update(one.read_bytes())
    return digest.hexdigest()


@cache
def _imported(path: Path, root: Path, package: str) -> tuple[Path, ...]:
    """Files of the package that a file imports itself."""
    names = set[str]()
    for module, what, alone in _IMPORT.findall(path.read_text("utf-8")):
        names |= {module or alone, *(f"{module}.{name}" for name in re.findall(r"\w+", what))}
    files = [root.joinpath(*name.split(".")) for name in names if name.partition(".")[0] == package]
    return tuple(file for one in files for file in (one.with_suffix(".py"), one / "__init__.py") if file.is_file())
