"""robot.toml: what is proposed of a legged robot beside its URDF, for a person to read and edit."""

import json
from collections.abc import Iterable, Sequence
from os.path import relpath
from pathlib import Path

import numpy as np

from footfall.robot.legged.groups import longest_leg, part_lengths
from footfall.robot.legged.legged_model import LegChain, LeggedModel
from footfall.robot.legged.touching import Touching

CLEARANCE_SHARE = 0.02
"""Proposed clearances, as a share of the longest leg: a wide guess for a person to replace."""

EXAMPLES = (
    "# What it carries: a mass [kg] at a place in a link's frame [m], beside what the URDF weighs.",
    "# [[payload]]",
    '# name = "tool"',
    '# link = "…"',
    "# mass = 1.0",
    "# center = [0.0, 0.0, 0.1]",
    "",
    "# Stereo pairs on the chassis: where the middle of both lenses sits [m], and how a frame is turned in which they",
    "# look along x with z up [rad], in a link's frame. The images of a real rover say themselves how they were taken.",
    "# [[cameras]]",
    '# name = "front"',
    '# link = "…"',
    "# position = [0.3, 0.0, 0.05]",
    "# rpy = [0.0, 0.7, 0.0]  # 0.7 rad below level",
    "# width = 640  # [px]",
    "# height = 480  # [px]",
    "# fov_deg = 90.0  # from the left edge to the right",
    "# baseline = 0.08  # between the lenses [m]",
    "",
)


def proposal(model: LeggedModel, urdf: Path, out: Path, touching: Touching, folders: Sequence[Path] = ()) -> str:
    """The text of a robot.toml. Every entry says where it comes from: (URDF), (guessed), (sampled) or (assumed)."""
    tree = model.tree
    length = longest_leg(model)
    here = out.resolve().parent
    lines = [
        f"# {_comment(tree.name)}: proposed by `footfall robot init`. Edit it, then give it to `footfall robot check`.",
        "# (URDF): read there. (guessed): made of what was read. (sampled): counted. (assumed): put in what you know.",
        "",
        f"name = {_text(tree.name)}  # (URDF)",
        f"urdf = {_text(relpath(urdf.resolve(), here))}",
        f"packages = {_texts(relpath(folder.resolve(), here) for folder in folders)}  # folders that hold them",
        f"base = {_text(model.base)}  # (URDF) root link",
        f"mass_check = {tree.mass:.6g}  # [kg] (URDF) sum of links; write what the robot weighs, check compares",
        "",
    ]
    for leg in model.legs:
        lines += _leg(model, leg)
    lines += _joints(model)
    lines += [f"# no leg: {_comment(limb)}: {_comment(why)}" for limb, why in model.left_out.items()]
    lines += [
        "",
        "# Postures: joint = angle [rad] or way [m].",
        "[postures.neutral]  # (guessed) zero where the limits allow it, otherwise their middle; gravity is not asked",
        *(f"{_text(name)} = {angle:.6g}" for name, angle in tree.neutral().items()),
        "",
        "[clearances]  # least distances [m]",
        f"other_leg = {_length(length)}  # (assumed) {CLEARANCE_SHARE:.0%} of the longest leg, {length:z.3f} m",
        f"own_leg = {_length(length)}  # (assumed)",
        f"base = {_length(length)}  # (assumed)",
        f"ground = {_length(length)}  # (assumed) all but the feet",
        "",
        f"[collisions]  # (sampled) {touching.samples} postures drawn evenly within the limits, seed {touching.seed}",
        f"samples = {touching.samples}",
        f"seed = {touching.seed}",
        "# Touch in every one: so they are built, and they need no check.",
        f"always = {_pairs(touching.always)}",
        f"# Touch in none: seldomer than in {3 / touching.samples:.2%} of postures with 95 % confidence, not proven.",
        f"never = {_pairs(touching.never)}",
        f"# {len(touching.sometimes)} other pairs touch in some postures; these are to be checked.",
    ]
    return "\n".join(lines) + "\n"


def _joints(model: LeggedModel) -> list[str]:
    """What may be said of joints; all of it is commented out, as nobody here knows it."""
    joints = [model.tree.joint(name) for leg in model.legs for name in leg.joints]
    lacking = {what: [one.name for one in joints if not getattr(one, what) > 0] for what in ("effort", "velocity")}
    limits = [one.name for one in joints if one.kind != "continuous" and not one.lower < one.upper]
    lacking |= {"lower and upper": limits}
    lines = [
        "# What the URDF does not say of joints, or you know better: lower and upper limit [rad, m], effort [N·m, N],",
        "# velocity [rad/s, m/s], and stiffness [N·m/rad, N/m], by which a joint gives way that is held at a place.",
        "# With that of every joint of the legs, commands hold the pose of the chassis, and predictions sag.",
    ]
    lines += [f"# not in the URDF: {what} of {_comment(', '.join(names))}" for what, names in lacking.items() if names]
    return [*lines, f"# [joints.{_text(joints[0].name)}]", "# stiffness = 1000.0", "", *EXAMPLES]


def _leg(model: LeggedModel, leg: LegChain) -> list[str]:
    sole, lengths = leg.sole, part_lengths(model.tree, leg)
    lines = [f"# doubtful: {_comment(leg.doubt)}"] if leg.doubt else []
    lines += [
        "[[legs]]",
        f"name = {_text(leg.name)}  # (guessed) what the foot links' names don't share",
        f"foot = {_text(leg.foot)}  # (URDF) end of the chain; parts {', '.join(f'{one:z.3f}' for one in lengths)} m",
        f"joints = {_texts(leg.joints)}  # (URDF) base → foot",
        f"group = {leg.group}  # (guessed) legs built alike have one number",
        f"sole = {_text(sole.kind)}  # (guessed) {_comment(sole.doubt) or 'from the collision shape'}",
        f"center = {_numbers(sole.center)}  # [m] in the foot link's frame",
    ]
    if sole.radius:
        lines.append(f"radius = {sole.radius:.6g}  # [m]")
    if sole.width:
        lines.append(f"width = {sole.width:.6g}  # [m]")
    if sole.axis.any():
        what = "axle" if sole.kind == "wheel" else "outward normal"
        lines.append(f"axis = {_numbers(sole.axis)}  # {what}, in the foot link's frame")
    if len(sole.polygon):
        corners = ", ".join(_numbers(corner) for corner in sole.polygon)
        lines.append(f"polygon = [{corners}]  # [m] counter-clockwise seen from below")
    return [*lines, ""]


def _length(longest_leg: float) -> str:
    return f"{CLEARANCE_SHARE * longest_leg:.3g}"


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    rows = "".join(f"    {_texts(pair)},\n" for pair in pairs)
    return f"[\n{rows}]" if rows else "[]"


def _texts(items: Iterable[str]) -> str:
    return f"[{', '.join(_text(item) for item in items)}]"


def _numbers(items: np.ndarray) -> str:
    return f"[{', '.join(f'{item + 0.0:.6g}' for item in np.round(items, 9))}]"


def _text(text: str) -> str:
    # a JSON string is a TOML basic string, but for DEL, which TOML wants escaped
    return json.dumps(text).replace("\x7f", "\\u007f")


def _comment(text: str) -> str:
    return "".join(sign if sign.isprintable() else "?" for sign in text)
