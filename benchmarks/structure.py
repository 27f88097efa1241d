"""The structure of the program in figures, of any git revision: ``python -m benchmarks.structure REVISION …``.

Counted are the modules below ``backend/footfall`` and ``footfall_ui``, in the files that git has of the revision; of
those nothing is imported or run. The table has a column for each revision. How each figure is counted:

- lines of a module are all of them, of a function or method those from ``def`` to its end; nested ones count, too;
- complexity is McCabe's, by ruff; modules without a line of code are left out of the medians;
- public is what is at the top of a module, or in a public class there, and has no underscore in front;
- from an address to its planner: the fewest files in a chain of imports from the route of ``POST …/plans`` to
  ``plan_step``, both ends included; imports inside functions count, packages' own modules don't;
- a kind of product is named where its name is written down to find out, or to say, of which kind something is, as
  ``tests/architecture/test_product_kinds.py`` has it, which allows it in the table of kinds alone.
"""

import ast
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from benchmarks.revisions import archive_of
from tests.architecture.test_product_kinds import OTHER_KINDS, ROOT, TABLE, compared

FOLDERS = ("backend/footfall", "footfall_ui")
COMPLEX = 10
ADDRESS = re.compile(r'"[^"]*/sessions/\{session\}/plans", status_code=202')
PLANNER = re.compile(r"^def plan_step\(", re.MULTILINE)

Sources = Mapping[str, str]
"""Path inside the repository → text of a Python file."""


@dataclass(frozen=True)
class Sizes:
    """How many there are, and how long they are [lines]."""

    count: int
    median: float
    p90: float
    longest: int

    def __str__(self) -> str:
        return f"{self.count}; {self.median:.0f} / {self.p90:.0f} / {self.longest}"


@dataclass(frozen=True)
class Structure:
    """The figures of one revision. files_to_planner: a chain of imports, empty where there is none."""

    modules: Sizes
    functions: Sizes
    complex: int
    public: int
    documented: int
    files_to_planner: tuple[str, ...]
    kinds_named: int


def sources_of(revision: str, repository: Path = ROOT) -> Sources:
    """The Python files that git has of a revision; raises CalledProcessError where there is no such revision."""
    with archive_of(revision, repository, *FOLDERS) as archive:
        files = {one.name: archive.extractfile(one) for one in archive if one.name.endswith(".py")}
        return {name: file.read().decode() for name, file in files.items() if file is not None}


def structure(sources: Sources) -> Structure:
    """All figures of a program."""
    trees = {path: ast.parse(text) for path, text in sources.items()}
    parts = [part for tree in trees.values() for part in public_parts(tree)]
    return Structure(
        _sizes([len(text.splitlines()) for text in sources.values()]),
        _sizes([length for tree in trees.values() for length in _function_lengths(tree)]),
        complex_functions(sources),
        len(parts),
        sum(ast.get_docstring(part) is not None for part in parts),
        _files_to_planner(sources, trees),
        sum(1 for path, text in sources.items() if ROOT / path not in {TABLE, *OTHER_KINDS} for _ in compared(text)),
    )


def public_parts(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef]:
    """Public functions and classes at the top of a module, and public methods of those classes."""
    for part in tree.body:
        if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) and not part.name.startswith("_"):
            yield part
            for inner in part.body if isinstance(part, ast.ClassDef) else ():
                if isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef) and not inner.name.startswith("_"):
                    yield inner


def complex_functions(sources: Sources) -> int:
    """Functions and methods whose complexity is above COMPLEX, by ruff."""
    with tempfile.TemporaryDirectory() as folder:
        for path, text in sources.items():
            file = Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        ruff = [sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache", "--ignore-noqa", "--exit-zero"]
        chosen = ["--select", "C901", "--config", f"lint.mccabe.max-complexity={COMPLEX}", "--output-format", "json"]
        found = subprocess.run([*ruff, *chosen, folder], check=True, stdout=subprocess.PIPE).stdout
    return len(json.loads(found))


def shortest_chain(imports: Mapping[str, set[str]], begin: str, end: str) -> tuple[str, ...]:
    """The fewest files from one to another that each imports the next; empty where there is no such chain."""
    chains, seen = [(begin,)], {begin}
    for chain in chains:
        if chain[-1] == end:
            return chain
        following = sorted(imports[chain[-1]] - seen)
        seen.update(following)
        chains += [(*chain, one) for one in following]
    return ()


def imports_of(trees: Mapping[str, ast.Module]) -> dict[str, set[str]]:
    """Which modules each module imports of these, packages' own left out."""
    files = {_module(path): path for path in trees}
    found: dict[str, set[str]] = {}
    for path, tree in trees.items():
        names = set[str]()
        for part in ast.walk(tree):
            if isinstance(part, ast.Import):
                names |= {alias.name for alias in part.names}
            elif isinstance(part, ast.ImportFrom) and part.module:
                names |= {part.module, *(f"{part.module}.{alias.name}" for alias in part.names)}
        found[path] = {files[name] for name in names & set(files) if not files[name].endswith("/__init__.py")}
    return found


def _module(path: str) -> str:
    return ".".join(PurePosixPath(path.removeprefix("backend/")).with_suffix("").parts)


def _files_to_planner(sources: Sources, trees: Mapping[str, ast.Module]) -> tuple[str, ...]:
    begin = [path for path, text in sources.items() if "/api/" in path and ADDRESS.search(text)]
    end = [path for path, text in sources.items() if "/planning/step/" in path and PLANNER.search(text)]
    return shortest_chain(imports_of(trees), begin[0], end[0]) if begin and end else ()


def _function_lengths(tree: ast.Module) -> list[int]:
    functions = [part for part in ast.walk(tree) if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [(part.end_lineno or part.lineno) - part.lineno + 1 for part in functions]


def _sizes(lengths: list[int]) -> Sizes:
    some = np.array([length for length in lengths if length])
    return Sizes(len(some), float(np.median(some)), float(np.percentile(some, 90)), int(some.max()))


def rows(found: Structure) -> dict[str, str]:
    """What is printed of each figure, by its name."""
    share = 100 * found.complex / found.functions.count
    return {
        "modules; lines, median / 90 % / longest": str(found.modules),
        "functions and methods; lines, median / 90 % / longest": str(found.functions),
        f"of these more complex than {COMPLEX}": f"{found.complex}; {share:.1f} %",
        "public functions, classes and methods; with a docstring": (
            f"{found.public}; {100 * found.documented / found.public:.0f} %"
        ),
        "files from an address to its planner": str(len(found.files_to_planner) or "no chain"),
        "places that name a kind of product, its table apart": str(found.kinds_named),
    }


def main(revisions: list[str]) -> int:
    """Prints the table, and below it the chains of files."""
    found = {revision: structure(sources_of(revision)) for revision in revisions}
    told = {revision: rows(one) for revision, one in found.items()}
    print("| |", " | ".join(revisions), "|")
    print("| --- |" + " --- |" * len(revisions))
    for name in next(iter(told.values())):
        print(f"| {name} |", " | ".join(one[name] for one in told.values()), "|")
    for revision, one in found.items():
        print(f"\n{revision}: {' → '.join(one.files_to_planner)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["HEAD"]))
