"""Comparing this tree's figures with an earlier revision's: whose turn it is, ratios, and what is laid out."""

import subprocess

import pytest

from benchmarks import revisions
from benchmarks.revisions import Compared, compared, in_turns, lay_out, main, of_one_only, run_of

FIGURES = 'import json; print(json.dumps({"figures": {"%s": {"median": %g}}}))'


def git(folder, *arguments):
    author = ["-c", "user.name=Anyone", "-c", "user.email=anyone@example.org"]
    subprocess.run(["git", *author, *arguments], cwd=folder, check=True, stdout=subprocess.PIPE)


def test_the_turns_weigh_on_both_alike(tmp_path):
    before, now = tmp_path / "before", tmp_path / "now"
    assert list(in_turns(before, now, 3)) == [before, now, now, before, before, now]


def test_a_ratio_is_now_over_before_of_each_pair():
    (row,) = compared([{"x": 2.0}, {"x": 4.0}], [{"x": 3.0}, {"x": 4.0}])
    assert row == Compared("x", (2.0, 4.0), (3.0, 4.0))
    assert row.ratios == (1.5, 1.0)
    assert str(row).split() == ["x", "3", "3.5", "1.250", "1.000", "to", "1.500"]


def test_what_only_one_has_is_named_by_who_lacks_it():
    before, now = [{"both": 1.0, "old": 1.0}] * 2, [{"both": 1.0, "new": 1.0}, {"both": 1.0, "new": 1.0, "once": 1.0}]
    assert [row.name for row in compared(before, now)] == ["both"]
    assert of_one_only(before, now) == {"before": ["new", "once"], "now": ["once", "old"]}


def test_a_revision_is_laid_out_as_git_has_it(tmp_path):
    repository, folder = tmp_path / "repository", tmp_path / "out"
    repository.mkdir()
    git(repository, "init", "-q")
    (repository / "a.txt").write_text("first")
    git(repository, "add", "a.txt")
    git(repository, "commit", "-q", "-m", "first")
    (repository / "a.txt").write_text("changed")
    assert (lay_out("HEAD", folder, repository) / "a.txt").read_text() == "first"
    with pytest.raises(subprocess.CalledProcessError):
        lay_out("no-such-revision", folder, repository)


def program(folder, text):
    """A source whose ``footfall`` command runs ``text``."""
    (folder / "backend" / "footfall").mkdir(parents=True)
    (folder / "backend" / "footfall" / "__init__.py").write_text("")
    body = "\n".join(f"    {line}" for line in text.splitlines())
    (folder / "backend" / "footfall" / "cli.py").write_text(f"def app():\n{body}\n")
    return folder


def test_each_source_runs_its_own_program(tmp_path):
    first = program(tmp_path / "first", FIGURES % ("steps", 2))
    assert run_of(first, ["step"], quick=True) == {"steps": 2.0}
    asking = program(
        tmp_path / "asking", 'import os; assert "OPENBLAS_CORETYPE" not in os.environ\n' + FIGURES % ("x", 1)
    )
    assert run_of(asking, [], quick=False) == {"x": 1.0}
    silent = program(tmp_path / "silent", "print('no such area')")
    with pytest.raises(ValueError, match=r"printed no figures: 'no such area"):
        run_of(silent, ["step"], quick=False)


def test_the_table_is_of_both_sources(tmp_path, monkeypatch, capsys):
    now = program(tmp_path / "now", FIGURES % ("steps", 3))
    monkeypatch.setattr(revisions, "ROOT", now)
    monkeypatch.setattr(revisions, "lay_out", lambda revision, folder: program(folder, FIGURES % ("steps", 2)))
    assert main(["anything", "step", "--pairs", "1"]) == 0
    head, row = capsys.readouterr().out.splitlines()
    assert head.split()[:4] == ["figure", "before", "now", "ratio"]
    assert row.split()[:4] == ["steps", "2", "3", "1.500"]
