"""A command sheet for print (A4): one HTML file with its pictures, which asks for nothing from elsewhere.

Angles are rounded to 0.01°, times to 0.01 s; the file says so and names the digest of the exact sequence.
Texts that come from files are escaped, and characters that don't print are shown as their code.
"""

import html
import math

import numpy as np

from footfall.io.exports.sheet_drawing import heading, side_view, top_view, wheel_paths
from footfall.io.robot_files import load_robot, robot_names
from footfall.robot.model import Robot
from footfall.sequence.commands import LEG_JOINTS, Command, Sequence, by_leg
from footfall.telemetry.joint_layout import JointLayout

_STYLE = """\
@page { size: A4; margin: 12mm }
body { font: 9pt/1.35 sans-serif; color: #000; background: #fff; margin: 0 auto; max-width: 186mm }
h1 { font-size: 15pt; margin: 0 0 2mm }
h2 { font-size: 11pt; margin: 4mm 0 1mm }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0 4mm; margin: 0 }
dt { font-weight: bold }
dd { margin: 0; overflow-wrap: anywhere }
.pictures { display: flex; flex-wrap: wrap; gap: 4mm; margin: 3mm 0 }
figure { margin: 0; break-inside: avoid }
figcaption { font-size: 8pt; max-width: 88mm }
svg { border: 0.2mm solid #888; display: block }
svg text { font-size: 3px }
svg * { fill: none; stroke-width: 0.4 }
svg text { fill: #000; stroke: none }
.start { stroke: #999 } .end { stroke: #000 } .thin { stroke: #000; stroke-width: 0.2 }
.path { stroke: #06c; stroke-width: 0.7 }
table { border-collapse: collapse; width: 100%; font-size: 6.5pt; font-variant-numeric: tabular-nums }
thead { display: table-header-group }
tr { break-inside: avoid }
th, td { border: 0.2mm solid #888; padding: 0.5mm 1mm; text-align: right; vertical-align: top }
td.text, th.text { text-align: left }
.sign { display: grid; grid-template-columns: repeat(3, 1fr); gap: 6mm; margin-top: 8mm; break-inside: avoid }
.sign span { border-top: 0.3mm solid #000; padding-top: 1mm }
"""
_COLUMNS = ("row", "at s", "command", "leg", "phase", *(f"{part.replace('_', ' ')} °" for part in LEG_JOINTS))
_LEFT = ("command", "phase")


def encode(sequence: Sequence, robot: Robot | None = None) -> bytes:
    """UTF-8 HTML. The pictures need the robot; without ``robot`` it is looked for among those that ship."""
    robot = robot or _shipped(sequence)
    name = f"{sequence.robot}, sequence {sequence.digest[:8]}"
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">",
        f"<title>Command sheet: {plain(name)}</title>",
        f"<style>\n{_STYLE}</style></head><body>",
        f"<h1>Command sheet: {plain(name)}</h1>",
        _facts(sequence),
        _pictures(sequence, robot),
        "<h2>Commands</h2>",
        _table(sequence),
        _whole_rules(sequence),
        '<div class="sign"><span>Checked by</span><span>Released by</span><span>Date and time (UTC)</span></div>',
        "</body></html>",
    ]
    return "\n".join(parts).encode() + b"\n"


def plain(text: str) -> str:
    """HTML that shows just this text; characters that don't print are shown as their code."""
    return html.escape("".join(one if one.isprintable() else f"\\u{ord(one):04x}" for one in text))


def _shipped(sequence: Sequence) -> Robot | None:
    if sequence.robot not in robot_names():
        return None
    robot = load_robot(sequence.robot)
    return robot if len(sequence.start) == 6 * robot.leg_count else None


def _facts(sequence: Sequence) -> str:
    balance = [rule.margin for rule in sequence.rules if rule.rule == "balance"]
    parents = ", ".join(f"{name} {digest}" for name, digest in sequence.provenance.parents.items())
    x, y, z = sequence.T_site_base[:3, 3]
    facts = {
        "Robot": plain(sequence.robot),
        "Sequence": sequence.digest,
        "Made from": plain(parents) or "nothing recorded",
        "Software": f"FootFall {plain(sequence.provenance.software)}",
        "Commands": str(len(sequence.commands)),
        "Duration": f"{sequence.duration:z.2f} s, without waiting between commands",
        "Chassis at start": f"x {x:z.3f} m, y {y:z.3f} m, z {z:z.3f} m in the site",
        "Least balance": f"{min(balance):z.3f} m inside the feet" if balance else "not checked",
    }
    return "<dl>" + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in facts.items()) + "</dl>"


def _pictures(sequence: Sequence, robot: Robot | None) -> str:
    if robot is None:
        return f"<p>No pictures: {plain(sequence.robot)} is not a robot that ships with FootFall.</p>"
    paths = wheel_paths(robot, sequence)
    drawn = [
        (
            top_view(robot, sequence, paths),
            "From above: the site's x to the right, y up. Grey: start; black: end; blue: paths of wheel centres.",
        )
    ]
    for leg, path in paths.items():
        drawn.append(
            (
                side_view(robot, sequence, leg, path),
                f"Leg {leg} from the side: to the right is {heading(path):z.0f}° from the site's x "
                "towards y, up is up. The ground is not drawn.",
            )
        )
    figures = "".join(f"<figure>{svg}<figcaption>{text}</figcaption></figure>" for svg, text in drawn)
    return f'<div class="pictures">{figures}</div>'


def _table(sequence: Sequence) -> str:
    units: dict[str, str] = {}
    least: dict[tuple[int, str], float] = {}
    for rule in sequence.rules:
        # a duration's margin is the duration
        if rule.row >= 0 and math.isfinite(rule.margin) and rule.rule != "duration":
            units[rule.rule] = rule.unit
            key = (rule.row, rule.rule)
            least[key] = min(rule.margin, least.get(key, math.inf))
    kept = [plain(f"{name.replace('-', ' ')} {unit}") for name, unit in units.items()]
    names = [*_COLUMNS, "takes s", "until N", *kept]
    head = "".join(f"<th{' class=text' if name in _LEFT else ''}>{name}</th>" for name in names)
    body, at, layout = [], 0.0, sequence.layout
    for row, command in enumerate(sequence.commands):
        body.append(_rows(row, at, command, layout, [least.get((row, rule), math.nan) for rule in units]))
        at += command.duration
    note = (
        "<p>Right of “until N”: by how much each rule is kept. Angles are rounded to 0.01°, times to 0.01 s: "
        "send the file of the digest above, don't type this in.</p>"
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(body)}</tbody></table>{note}"


def _rows(row: int, at: float, command: Command, layout: JointLayout, margins: list[float]) -> str:
    """One line of the table for each leg that the command moves."""
    legs: list[tuple[int | None, list[str]]] = [
        (leg, [f"{angle:z.2f}" for angle in np.degrees(angles).tolist()]) for leg, angles in by_leg(command, layout)
    ] or [(None, [""] * len(LEG_JOINTS))]
    tall = f' rowspan="{len(legs)}"' if len(legs) > 1 else ""
    first = f"<td{tall}>{row + 1}</td><td{tall}>{at:z.2f}</td><td class=text{tall}>{plain(command.name)}</td>"
    phase = f"<td class=text{tall}>{plain(command.phase)}</td>"
    force = "" if command.force is None else f"{command.force:z.1f}"
    kept = "".join(f"<td{tall}>{f'{margin:z.3f}' if math.isfinite(margin) else ''}</td>" for margin in margins)
    last = f"<td{tall}>{command.duration:z.2f}</td><td{tall}>{force}</td>{kept}"
    lines = []
    for number, (leg, angles) in enumerate(legs):
        own = f"<td>{'' if leg is None else leg}</td>"
        joints = "".join(f"<td>{angle}</td>" for angle in angles)
        lines.append(f"<tr>{first}{own}{phase}{joints}{last}</tr>" if number == 0 else f"<tr>{own}{joints}</tr>")
    return "".join(lines)


def _whole_rules(sequence: Sequence) -> str:
    rules = [rule for rule in sequence.rules if rule.row < 0]
    if not rules:
        return ""
    items = "".join(f"<li>{plain(rule.rule)}: {plain(rule.text)}</li>" for rule in rules)
    return f"<h2>Rules of the whole sequence</h2><ul>{items}</ul>"
