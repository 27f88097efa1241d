"""What the rover looks like: rounded parts of several materials, made of the same description as its shapes.

For pictures alone. Every part lies inside the mesh that collisions are checked with, so that the picture never shows
more room taken than is checked, nor a part where the check has none; and no point of that mesh is farther than
FARTHEST from the parts, a wheel in its fork counted with it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from footfall.core.arrays import Array
from footfall.core.mesh import Mesh
from footfall.robot.description import JOINTS, RobotDescription
from footfall.robot.meshes import shapes
from footfall.robot.meshes.rounded import beam, drum, looped, ring, skinned, turned

PAINT, METAL, DARK, RUBBER, FOIL, MARK = "paint", "metal", "dark", "rubber", "foil", "mark"
"""Materials: white painted aluminium, bare metal, dark housings of drives, tyre, gold foil, the arrow that points
forward."""
FARTHEST = 0.1
"""Of a shape's surface from the parts that are drawn of it [m]."""
ROUND, ROUNDEST = 0.25, 0.05
"""Radius of a beam's edges: share of its thickness, and at most [m]."""
SLIM = 0.72
"""Width of a beam beside that of its shape, where a housing is as wide."""
TAPER = 0.75
"""Thickness of a beam at its far end beside that at its near one, where a housing is at its near end."""
LONG = 2.0
"""A beam so many times as long as thick is tapered."""
COVER = 0.006
"""By how much the cover of a housing stands out of it [m]."""
COLLAR = 0.12
"""Length of the housing at the near end of a beam that turns about itself, share of the beam's."""
LUGS, SIDES = 20, 80
"""Treads around a wheel, and corners of its outline."""
GROOVE = 0.05
"""Depth of the grooves between the treads, share of the radius."""
TYRE = (
    (-0.42, 0.64), (-0.49, 0.74), (-0.47, 0.9), (-0.36, 0.985), (-0.02, 1.0),
    (0.02, 1.0), (0.36, 0.985), (0.47, 0.9), (0.49, 0.74), (0.42, 0.64),
)  # fmt: skip
"""Across a tyre: places along the axle, share of its width; radius there, share of the wheel's."""
TREAD = range(3, len(TYRE) - 3)
"""Which of them have grooves."""
RIM = ((-0.5, 0.15), (-0.49, 0.17), (-0.46, 0.18), (-0.22, 0.2), (-0.16, 0.5), (-0.36, 0.58), (-0.4, 0.6), (-0.4, 0.64))
"""Of hub and rim in the same way, from the outer end of the hub inward."""
SPOKES = 3
"""Bars across a rim."""
PLATE = 0.9
"""Width of the plates of a fork, share of what is left beside the wheel."""
AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Part:
    """material: one of the six above. mesh: in the link's frame."""

    material: str
    mesh: Mesh


@lru_cache(maxsize=4)
def display_parts(description: RobotDescription) -> dict[str, tuple[Part, ...]]:
    """Link → its parts, the same object for links that are built alike.

    A link whose shape is neither a box nor a wheel is its own shape, but for the chassis.
    """
    made: dict[tuple[str, str, float], tuple[Part, ...]] = {}
    parts: dict[str, tuple[Part, ...]] = {}
    for link, mesh in description.meshes.items():
        leg, _, name = link.partition("_")
        foot = description.legs[int(leg.removeprefix("leg"))].foot if name else 0.0
        alike = (name, mesh.digest, foot)
        if alike not in made:
            made[alike] = _parts_of(description, name, mesh, foot)
        parts[link] = made[alike]
    return parts


def _parts_of(description: RobotDescription, name: str, shape: Mesh, foot: float) -> tuple[Part, ...]:
    """name: of the part of a leg, none for the chassis; foot: from ankle to wheel [m]."""
    axes = dict(JOINTS)
    if not name:
        return _deck(shape)
    if name == "wheel":
        return _wheel(shape, description.wheel_radius, description.wheel_width)
    if name not in axes or not _is_box(shape):
        return (Part(PAINT, shape),)
    if name == JOINTS[-1][0]:
        return _fork(shape, foot, description)
    return _limb(shape, AXES[axes[name]])


def _is_box(mesh: Mesh) -> bool:
    """Whether its vertices are the corners of the box around it."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return len(mesh.vertices) == 8 and bool(((mesh.vertices == low) | (mesh.vertices == high)).all())


def _bounds(shape: Mesh) -> tuple[Array, Array]:
    return shape.vertices.min(axis=0), shape.vertices.max(axis=0)


def _edge(size: Array) -> float:
    return min(ROUND * float(size.min()), ROUNDEST)


def _limb(shape: Mesh, axis: int) -> tuple[Part, ...]:
    """A beam along the longest side, and the drive's housing about its axis through the link's origin."""
    low, high = _bounds(shape)
    size = high - low
    along = int(np.argmax(size))
    across = [i for i in range(3) if i != axis]
    radius = float(min(np.minimum(-low, high)[across].min(), 0.5 * size[across].min()))
    if along == axis and low[axis] > 0:
        return _collared(low, high, axis)
    if radius <= 0:
        return (Part(PAINT, beam(low, high, _edge(size))),)
    housing = _housing(low[axis], high[axis], radius, axis)
    if along == axis:
        return housing
    slim = np.ones(3)
    slim[axis] = SLIM
    middle, half = 0.5 * (low + high), 0.5 * size * slim
    taper = TAPER if size[along] > LONG * size.min() else 1.0
    return Part(PAINT, beam(middle - half, middle + half, _edge(size), taper)), *housing


def _housing(begin: float, end: float, radius: float, axis: int) -> tuple[Part, ...]:
    """A drive's drum from one place on its axis to another, and a bare cover on both ends."""
    cover = min(COVER, 0.1 * (end - begin))
    return (
        Part(DARK, drum(begin + cover, end - cover, radius, axis)),
        Part(METAL, drum(begin, end, 0.6 * radius, axis, edge=0.06)),
    )


def _collared(low: Array, high: Array, axis: int) -> tuple[Part, ...]:
    """A beam that turns about its own length: its drive is a collar at the near end."""
    size = high - low
    across = [i for i in range(3) if i != axis]
    length = COLLAR * float(size[axis])
    radius = float(min(np.minimum(-low, high)[across].min(), 0.5 * size[across].min()))
    inner = low.copy()
    inner[axis] += 0.5 * length
    bar = Part(PAINT, beam(inner, high, _edge(size)))
    if radius <= 0:
        return (bar,)
    return bar, Part(DARK, drum(low[axis], low[axis] + 2 * length, radius, axis))


def _fork(shape: Mesh, foot: float, description: RobotDescription) -> tuple[Part, ...]:
    """A beam that ends before the wheel, and a plate on both sides of the wheel as far as the shape goes."""
    low, high = _bounds(shape)
    ends, inside = foot - description.wheel_radius, 0.5 * description.wheel_width
    beside = min(float(high[1]), -float(low[1])) - inside
    if beside <= 0 or not low[0] < ends < high[0]:
        return _limb(shape, 0)
    bar, *collar = _collared(low, np.array([ends, high[1], high[2]]), 0)
    plates = []
    for side in (low[1], high[1] - PLATE * beside):
        corner = np.array([ends - 0.5 * beside, side, low[2]])
        plates.append(beam(corner, np.array([high[0], side + PLATE * beside, high[2]]), PLATE * beside))
    return bar, *collar, Part(METAL, shapes.merged(plates))


def _wheel(shape: Mesh, radius: float, width: float) -> tuple[Part, ...]:
    """A tyre with rounded shoulders and treads, and a rim with spokes whose hub is as wide as the wheel.

    The shape's corners are on its radius, so that the tyre is as large as the circle inside them.
    """
    sides = len(shape.vertices) // 2
    inner = radius * float(np.cos(np.pi / sides))
    place = np.arange(SIDES) * LUGS / SIDES % 1.0
    tread = np.where(place < 0.5, 1.0, 1.0 - GROOVE)
    rings = []
    for i, (along, share) in enumerate(TYRE):
        grooved = tread if i in TREAD else np.ones(SIDES)
        # the treads of both halves are shifted against each other
        rings.append(ring(1, along * width, inner * share * (grooved if along < 0 else np.roll(grooved, 2))))
    half = np.array(RIM) * (width, inner)
    rim = turned(np.concatenate([half, half[::-1] * (-1.0, 1.0)]), 1)
    bars = []
    for number in range(SPOKES):
        bar = shapes.box((1.12 * inner, 0.56 * width, 0.09 * inner))
        turn = np.pi * number / SPOKES
        c, s = np.cos(turn), np.sin(turn)
        bars.append(Mesh(bar.vertices @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]), bar.triangles))
    return Part(RUBBER, looped(rings)), Part(METAL, shapes.merged([rim, *bars]))


def _deck(shape: Mesh) -> tuple[Part, ...]:
    """A painted ring above and below, foil between them, the deck inside, and an arrow on it that points forward."""
    low, high = _bounds(shape)
    middle, height = 0.5 * (low + high), high[2] - low[2]
    around = shape.vertices[np.argsort(np.arctan2(shape.vertices[:, 1] - middle[1], shape.vertices[:, 0] - middle[0]))]
    rim, foot = (around[np.isclose(around[:, 2], z)] for z in (high[2], low[2]))
    if len(rim) != len(foot) or len(rim) * 2 != len(shape.vertices):
        return (Part(PAINT, shape),)

    def outline(share: float, up: float) -> Array:
        """Corners at a height over the foot, so much of the way out from the middle."""
        points = middle + share * (foot + up / height * (rim - foot) - middle)
        points[:, 2] = low[2] + up
        return points

    tube = 0.24 * height
    edge = ((0.97, 0.0), (0.99, 0.06), (1.0, 0.3), (1.0, 0.7), (0.99, 0.94), (0.97, 1.0))
    tubes = [
        skinned([outline(share, begin + up * tube) for share, up in edge]) for begin in (0.0, height - tube - 0.012)
    ]
    # the upper tube is open inside: the deck lies in it
    tubes[1] = looped(
        [outline(share, height - tube - 0.012 + up * tube) for share, up in (*edge, (0.9, 1.0), (0.9, 0.0))]
    )
    foil = skinned([outline(0.975, tube), outline(0.975, height - tube - 0.012)])
    panel = skinned([outline(0.9, height - tube), outline(0.9, height - 0.03), outline(0.89, height - 0.02)])
    reach = high[0] - middle[0]
    arrow = [(0.62, 0.0), (0.44, 0.12), (0.44, 0.05), (0.2, 0.05), (0.2, -0.05), (0.44, -0.05), (0.44, -0.12)]
    flat = np.column_stack([middle[0] + reach * np.array(arrow), np.full(len(arrow), high[2])])
    return Part(PAINT, shapes.merged(tubes)), Part(FOIL, foil), Part(METAL, panel), Part(MARK, _arrow(flat))


def _arrow(corners: Array) -> Mesh:
    """Of a triangle and a shaft, seen from above."""
    return Mesh(corners, np.array([(0, 1, 6), (2, 3, 4), (2, 4, 5)], np.int32))
