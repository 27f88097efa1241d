"""The command sheet: the numbers of every row, pictures of the right places, nothing from elsewhere, A4."""

import math
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings

from footfall.core.errors import InvalidSequence
from footfall.core.frames import apply
from footfall.io.exports import export
from footfall.robot.kinematics import wheel_centers
from footfall.sequence.commands import Sequence
from tests.support.sequences import HOSTILE, any_commands, four_kinds, recorded, unchecked

JOINTS = slice(5, 11)


class Table(HTMLParser):
    """The cells of the table, line by line, those that span several lines repeated; and every tag with attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.lines: list[list[str]] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._spans: list[int] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if tag == "tr":
            self.lines.append([])
        if tag in ("td", "th"):
            self._repeat()
            self.lines[-1].append("")
            column = len(self.lines[-1]) - 1
            self._spans += [0] * (column + 1 - len(self._spans))
            self._spans[column] = int(attributes.get("rowspan") or 1) - 1

    def handle_endtag(self, tag):
        if tag == "tr":
            self._repeat()

    def _repeat(self):
        column = len(self.lines[-1])
        while column < len(self._spans) and self._spans[column] > 0:
            self._spans[column] -= 1
            self.lines[-1].append(self.lines[-2][column])
            column += 1

    def handle_data(self, data):
        if self.lines and self.lines[-1] and self.get_starttag_text() in self._cells():
            self.lines[-1][-1] += data

    def _cells(self):
        text = self.get_starttag_text() or ""
        return (text,) if re.match(r"<t[dh][ >]", text) else ()


def lines_of(sequence: Sequence) -> list[list[str]]:
    """The table's body, without what comes after it."""
    text = export(sequence, "html").decode()
    return Table(text[text.index("<table>") : text.index("</table>")]).lines[1:]


def require_numbers(sequence: Sequence) -> None:
    lines = lines_of(sequence)
    at = 0.0
    for row, command in enumerate(sequence.commands):
        joints = np.zeros((1, 0)) if command.joints is None else command.joints.reshape(-1, 6)
        for number, own in enumerate(joints):
            line = lines.pop(0)
            assert line[0] == str(row + 1)
            assert float(line[1]) == pytest.approx(at, abs=0.0051)
            assert line[2] == command.name
            leg = number if command.name == "POSTURE_MOVE" else command.leg
            assert line[3] == ("" if leg is None else str(leg))
            angles = [float(one) for one in line[JOINTS] if one]
            assert angles == pytest.approx(np.degrees(own), abs=0.0051, rel=1e-12)
            assert float(line[11]) == pytest.approx(command.duration, abs=0.0051)
            assert line[12] == ("" if command.force is None else f"{command.force:.1f}")
        at += command.duration
    assert lines == []


@pytest.mark.parametrize("name", ["rock-step", "fractal-step", "edited-export"])
def test_every_row_of_a_recorded_step(name):
    require_numbers(recorded(name))


@settings(max_examples=15)
@given(commands=any_commands())
def test_every_row_of_any_commands(commands):
    require_numbers(unchecked(commands))


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_the_margins_are_the_least_of_each_rule(name):
    sequence = recorded(name)
    text = export(sequence, "html").decode()
    head = Table(text[text.index("<table>") : text.index("</table>")]).lines[0]
    column = head.index("speed s")
    lines, seen = lines_of(sequence), 0
    for row in range(len(sequence.commands)):
        line = next(one for one in lines if one[0] == str(row + 1))
        margins = [rule.margin for rule in sequence.rules if (rule.row, rule.rule) == (row, "speed")]
        assert line[column] == (f"{min(margins):.3f}" if margins and math.isfinite(min(margins)) else "")
        seen += line[column] != ""
    assert seen >= 5


def svgs(sequence: Sequence) -> list[ElementTree.Element]:
    text = export(sequence, "html").decode()
    return [ElementTree.fromstring(one) for one in re.findall(r"<svg.*?</svg>", text, re.DOTALL)]


def circles(svg: ElementTree.Element, style: str) -> np.ndarray:
    found = [one for one in svg.iter() if one.tag.endswith("circle") and one.get("class") == style]
    return np.array([[float(one.get(name, "nan")) for name in ("cx", "cy", "r")] for one in found])


def test_the_wheels_are_drawn_where_they_stand(athlete):
    sequence = recorded()
    top = svgs(sequence)[0]
    for style, posture in (("start", sequence.start), ("end", sequence.predicted[-1])):
        drawn = circles(top, style)
        stand = apply(sequence.T_site_base, wheel_centers(athlete, posture))[:, :2]
        scale = drawn[0, 2] / athlete.wheel_radius
        moved = (drawn[1:, :2] - drawn[0, :2]) / scale * (1, -1)  # paper's y goes down
        assert moved == pytest.approx(stand[1:] - stand[0], abs=0.03)
    # one leg moved, the others are where they were
    assert (np.abs(circles(top, "start") - circles(top, "end")).max(axis=1) > 0.5).sum() == 1


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_the_side_view_shows_the_height_of_the_step(name, athlete):
    """With the pose held, as on fractal ground, all joints move in most rows; one leg steps."""
    sequence = recorded(name)
    side = svgs(sequence)[1]
    leg = next(one.leg for one in sequence.commands if one.leg is not None)
    heights = [
        apply(T, wheel_centers(athlete, posture))[leg, 2]
        for posture, T in [
            (sequence.start, sequence.T_site_base),
            *zip(sequence.predicted, sequence.poses, strict=True),
        ]
    ]
    path = next(one for one in side.iter() if (one.get("class") or "").startswith("path"))
    y = np.array([[float(number) for number in pair.split(",")] for pair in path.get("points", "").split()])[:, 1]
    scale = circles(side, "start")[0, 2] / athlete.wheel_radius
    assert np.ptp(y) / scale == pytest.approx(np.ptp(heights), abs=0.03)
    assert (y[0] - y.min()) / scale == pytest.approx(max(heights) - heights[0], abs=0.03)


def test_a_robot_of_another_name_is_drawn_when_it_is_given(athlete):
    other = unchecked(recorded().commands, robot="scout", start=recorded().start)
    assert b"No pictures: scout is not a robot that ships with FootFall" in export(other, "html")
    assert b"<svg" in export(other, "html", robot=athlete)


def test_nothing_is_asked_for_and_hostile_names_are_only_text():
    hostile = "".join(HOSTILE)
    text = export(four_kinds(robot=hostile, phase=hostile), "html").decode()
    allowed = {"rowspan", "class", "charset", "lang", "name", "content", "http-equiv"}
    for tag, attributes in Table(text).tags:
        assert tag not in ("script", "img", "link", "iframe", "object", "a", "base", "form")
        assert set(attributes) <= allowed
    assert "default-src 'none'" in text
    shown = "".join(one if one.isprintable() else f"\\u{ord(one):04x}" for one in hostile)
    assert lines_of(four_kinds(phase=hostile))[0][4] == shown
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]", text)


def test_a_broken_rule_is_not_exported():
    with pytest.raises(InvalidSequence, match="no commands"):
        export(unchecked(()), "html")
