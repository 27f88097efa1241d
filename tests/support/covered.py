"""What of each package the tests run, lines and branches, from what ``make coverage`` has measured; 1 below the floor.

Compiled functions run where no tracer sees them: their modules (``*_kernel.py``) are left out of the figures. What
holds there is shown by laws and second methods.
"""

import json
from collections import defaultdict
from pathlib import Path
from tempfile import TemporaryDirectory

from coverage import Coverage

PACKAGES = Path("backend") / "footfall"


def by_package(files: dict[str, dict]) -> dict[str, list[int]]:
    """Package → lines, lines run, branches, branches taken; files: as in coverage's JSON report."""
    found = defaultdict(lambda: [0, 0, 0, 0])
    for name, file in files.items():
        inside = Path(name).relative_to(PACKAGES).parts
        one, summary = found[inside[0] if len(inside) > 1 else "(top)"], file["summary"]
        for i, key in enumerate(("num_statements", "covered_lines", "num_branches", "covered_branches")):
            one[i] += summary[key]
    return dict(found)


def row(name: str, counts: list[int]) -> str:
    """One line of the table."""
    lines, run, branches, taken = counts
    return (
        f"{name:<12}{lines:8}{share(run, lines):>9}{branches:10}{share(taken, branches):>9}"
        f"{share(run + taken, lines + branches):>9}"
    )


def share(part: int, whole: int) -> str:
    return f"{part / whole:.1%}" if whole else "–"


def main() -> int:
    """Print the table; 1 where the whole is below ``fail_under`` of pyproject.toml."""
    measured = Coverage()
    measured.load()
    with TemporaryDirectory() as folder:
        report = Path(folder) / "coverage.json"
        measured.json_report(outfile=str(report))
        files = json.loads(report.read_text("utf-8"))["files"]
    packages = by_package(files)
    whole = [sum(column) for column in zip(*packages.values(), strict=True)]
    print(f"{'package':<12}{'lines':>8}{'run':>9}{'branches':>10}{'taken':>9}{'both':>9}")
    for name, counts in sorted(packages.items()):
        print(row(name, counts))
    print(row("all", whole))
    reached, floor = 100 * (whole[1] + whole[3]) / (whole[0] + whole[2]), measured.get_option("report:fail_under")
    if not isinstance(floor, (int, float)) or reached >= floor:
        return 0
    print(f"{reached:.1f} % is less than {floor:g} %; see which lines with `coverage report --show-missing`")
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
