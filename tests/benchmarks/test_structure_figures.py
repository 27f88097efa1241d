"""The figures of the structure, of small programs whose figures are known."""

import subprocess
from dataclasses import astuple

import pytest

from benchmarks.structure import complex_functions, rows, shortest_chain, sources_of, structure

BRANCHES = "".join(f"    if x == {i}:\n        return {i}\n" for i in range(9))
ROUTE = """
from footfall import made
from footfall.far import asked
@router.post("/sessions/{session}/plans", status_code=202)
def plan(): ...
"""
PROGRAM = {
    "backend/footfall/__init__.py": "from footfall.planning.step.plan import plan_step\n",
    "backend/footfall/api/routes/plans.py": ROUTE,
    "backend/footfall/made.py": '''
def ask():
    """Asks."""
    from footfall.planning.step.plan import plan_step
    return plan_step()
''',
    "backend/footfall/far.py": "import footfall.farther\ndef asked(): ...\n",
    "backend/footfall/farther.py": "from footfall.planning.step import plan\n",
    "backend/footfall/planning/step/plan.py": '''
class Plan:
    """A plan."""
    def check(self):
        return self.made.kind == "plan"
    def _own(self):
        def inner(): ...
def plan_step():
    return Plan()
''',
    "footfall_ui/__init__.py": "",
}


def test_a_small_program_has_the_figures_that_were_counted_by_hand() -> None:
    found = structure(PROGRAM)
    # lines of modules: 1, 5, 5, 2, 1, 9; of functions: 1, 4, 1, 2, 2, 1, 2
    assert astuple(found.modules) == pytest.approx((6, 3.5, 7.0, 9))
    assert astuple(found.functions) == pytest.approx((7, 2.0, 2.8, 4))
    assert (found.public, found.documented) == (6, 2), "plan, ask, asked, Plan, Plan.check and plan_step"
    assert found.kinds_named == 1
    assert rows(found)["public functions, classes and methods; with a docstring"] == "6; 33 %"


def test_the_shortest_chain_leads_past_packages_own_modules() -> None:
    names = ("api/routes/plans", "made", "planning/step/plan")
    assert structure(PROGRAM).files_to_planner == tuple(f"backend/footfall/{name}.py" for name in names)


def test_without_a_chain_that_is_said() -> None:
    alone = {name: text for name, text in PROGRAM.items() if "far" not in name and "made" not in name}
    assert rows(structure(alone))["files from an address to its planner"] == "no chain"


def test_the_chain_with_the_fewest_files_is_found_where_a_longer_one_is_met_first() -> None:
    imports = {"a": {"b", "z"}, "b": {"c"}, "c": {"d"}, "d": set[str](), "z": {"d"}}
    assert shortest_chain(imports, "a", "d") == ("a", "z", "d")
    assert shortest_chain(imports, "b", "z") == ()


@pytest.mark.parametrize(("more", "found"), [("", 0), ("    if x:\n        return 1\n", 1)])
def test_only_what_is_above_the_bound_is_complex(more: str, found: int) -> None:
    # one, and one for each of nine branches, is ten
    assert complex_functions({"footfall_ui/one.py": f"def chosen(x):\n{BRANCHES}{more}"}) == found


def test_a_revision_is_read_and_not_what_lies_there(tmp_path) -> None:
    def git(*words: str) -> None:
        name = ("-c", "user.name=F", "-c", "user.email=f@localhost", "-c", "commit.gpgsign=false")
        subprocess.run(["git", *name, *words], cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)

    git("init", "--quiet")
    for folder in ("backend/footfall", "footfall_ui"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "one.py").write_text("A = 1\n")
        (tmp_path / folder / "one.txt").write_text("no program\n")
    git("add", ".")
    git("commit", "--quiet", "--message", "one")
    (tmp_path / "footfall_ui/one.py").write_text("A = 2\n")
    (tmp_path / "footfall_ui/two.py").write_text("")
    assert sources_of("HEAD", tmp_path) == {"backend/footfall/one.py": "A = 1\n", "footfall_ui/one.py": "A = 1\n"}
