"""Commands in the documents are those that there are: each line is read by the real parser, each option is one's."""

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from footfall.cli import app
from footfall.core.errors import FootFallError
from tests.support.documents import DOCUMENTS, ROOT, code, lines_of_code, prose, spans

NUMBERS = {"X", "Y", "YAW", "Z", "N"}
"""What stands for a number."""
LEFT_OUT = "…"
OF_OTHERS = {"--nthreads", "--cov", "--cov-append", "--cov-fail-under", "--cov-report"}
"""Options of dask and pytest."""
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def typed(line: str) -> Iterator[list[str]]:
    """What is typed behind ``footfall`` on a line: of ``info|convert`` and of ``list | revoke NAME`` each."""
    line = re.sub(r"[\[\]]|(?<=[\w\]])…", "", re.split(r": ", line)[0])
    first, *others = line.split(" | ")
    stem = first.rpartition(" ")[0]
    for one in (first, *(f"{stem} {other}" for other in others)):
        for word in (re.findall(r"\w+(?:\|\w+)+", one) or [""])[0].split("|"):
            words = shlex.split(re.sub(r"\w+(?:\|\w+)+", word, one))
            yield ["1" if each in NUMBERS else each for each in words[1:]]


def misread(words: list[str], whole: bool) -> str:
    """What speaks against the words behind ``footfall``; empty where nothing does. whole: nothing is left out."""
    command: Any = get_command(app)
    while words and (within := getattr(command, "commands", None)) and not words[0].startswith("-"):
        if words[0] not in within:
            return f"there is no command {words[0]}"
        command, words = within[words[0]], words[1:]
    if LEFT_OUT in words or getattr(command, "commands", None):
        strange = {one for one in words if OPTION.fullmatch(one)} - options(command)
        return f"there is no {', '.join(sorted(strange))}" if strange else ""
    try:
        command.make_context(command.name, list(words))
    except FootFallError as error:
        return error.message
    except Exception as error:  # of the parser's own kinds
        lacks = type(error).__name__ == "MissingParameter" or "requires an argument" in str(error)
        return "" if lacks and not whole else f"{type(error).__name__}: {error}"
    return ""


def options(command: Any) -> set[str]:
    """All options of a command and of those within it."""
    own = {name for one in command.params for name in (*one.opts, *one.secondary_opts)}
    return own.union({"--help"}, *(options(one) for one in getattr(command, "commands", {}).values()))


@pytest.fixture(autouse=True)
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files that the parser wants to be there."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gaits.npz").touch()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.stem)
def test_every_command_line_is_read(document: Path) -> None:
    text = document.read_text("utf-8")
    fenced = [line.removeprefix(".venv/bin/") for line in lines_of_code(text)]
    told = [(line, True) for line in fenced] + [(span, False) for span in spans(text)]
    wrong = {
        line: against
        for line, whole in told
        if line.startswith("footfall ")
        for words in typed(line)
        if (against := misread(words, whole))
    }
    assert wrong == {}


def test_the_readme_lists_every_command() -> None:
    about = prose((ROOT / "README.md").read_text("utf-8")).partition("`footfall --help` lists everything:")[2]
    listed = list(spans(about.partition("`--json`")[0]))
    wrong = {one: against for one in listed for words in typed(f"footfall {one}") if (against := misread(words, False))}
    assert wrong == {}
    commands: Any = get_command(app)
    assert {one.split()[0] for one in listed} == set(commands.commands)


def test_every_area_of_the_benchmarks_is_one() -> None:
    tree = ast.parse((ROOT / "benchmarks/run.py").read_text("utf-8"))
    (areas,) = [
        {key.value for key in one.value.keys if isinstance(key, ast.Constant)}
        for one in tree.body
        if isinstance(one, ast.AnnAssign) and isinstance(one.value, ast.Dict)
    ]
    lines = [line for document in DOCUMENTS for line in code(document.read_text("utf-8"))]
    named = {word for line in lines if line.startswith("footfall bench") for word in line.split()[2:] if word[0] != "-"}
    assert len(named) > 8
    assert named <= areas


def test_every_option_is_one_of_a_program_here() -> None:
    programs = [
        path
        for folder in ("benchmarks", "training", "tests", "sample_sessions")
        for path in (ROOT / folder).rglob("*.py")
    ]
    others = {name for path in programs for name in re.findall(r'"(--[a-z-]+)"', path.read_text("utf-8"))}
    known = options(get_command(app)) | others | OF_OTHERS
    named = {
        (option, document.name)
        for document in DOCUMENTS
        for line in code(document.read_text("utf-8"))
        for option in OPTION.findall(line)
    }
    assert len(named) > 80
    assert sorted(one for one in named if one[0] not in known) == []


def test_every_module_that_is_run_is_there() -> None:
    for document in DOCUMENTS:
        for line in code(document.read_text("utf-8")):
            for module in re.findall(r"python -m ([\w.]+)", line):
                path = module.replace(".", "/")
                found = [ROOT / root / f"{path}{end}" for root in ("", "backend") for end in (".py", "/__main__.py")]
                assert module in ("pytest",) or any(one.is_file() for one in found), (document.name, module)


def test_every_target_of_make_is_one() -> None:
    targets = set(re.findall(r"^([\w$().-]+(?:/[\w.-]+)?):", (ROOT / "Makefile").read_text("utf-8"), re.M))
    targets |= {one.replace("$(VENV)", ".venv") for one in targets}
    for document in DOCUMENTS:
        for line in code(document.read_text("utf-8")):
            if line.startswith("make "):
                assert line.split()[1] in targets, (document.name, line)


def test_every_variable_of_the_environment_is_read() -> None:
    sources = "".join(
        path.read_text("utf-8")
        for folder in ("backend", "footfall_ui", "tests", "benchmarks")
        for path in (ROOT / folder).rglob("*.py")
    )
    named = {name for document in DOCUMENTS for name in re.findall(r"FOOTFALL_[A-Z_]+", document.read_text("utf-8"))}
    assert len(named) > 3
    assert [name for name in sorted(named) if f'"{name}"' not in sources] == []


@pytest.mark.parametrize(
    ("line", "whole", "read"),
    [
        ("footfall plan walk TERRAIN --goal X Y [YAW] --out walk.npz", True, True),
        ("footfall plan walk TERRAIN --goal X Y [YAW] --outt walk.npz", True, False),
        ("footfall plan walk TERRAIN", True, False),
        ("footfall plan walk TERRAIN", False, True),
        ("footfall plan walk … --margin 0.03", False, True),
        ("footfall plan walk … --margins 0.03", False, False),
        ("footfall terrain info|convert", False, True),
        ("footfall terrain info|turn", False, False),
        ("footfall accounts token list | revoke night-script", True, True),
        ("footfall accounts token list | forget night-script", True, False),
        ("footfall serve --data", False, True),
        ("footfall serve --workers many", False, False),
        ("footfall sessions verify [SESSION]…", False, True),
    ],
)
def test_a_line_is_read_as_it_is_typed(line: str, whole: bool, read: bool) -> None:
    assert all(not misread(words, whole) for words in typed(line)) == read
