"""What the rover looks like: rounded parts in the tones of their materials, made of the same description as its shapes.

For pictures alone. Every part lies inside the mesh that collisions are checked with, so that the picture never shows
more room taken than is checked, nor a part where the check has none; and it reaches that mesh's sides.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from footfall.core.mesh import Mesh
from footfall.robot import shapes
from footfall.robot.description import JOINTS, RobotDescription

Array = NDArray[np.float64]

DECK, BEAM, MOTOR, TYRE, MARK = "deck", "beam", "motor", "tyre", "mark"
"""Materials: painted deck, bare metal, dark housings, tyre, the arrow that points forward."""
CHAMFER = 0.3
"""Of the edges of a beam, share of its thickness; the same at its ends."""
SLIM = 0.7
"""Width of a beam beside that of its shape, where a housing is as wide."""
LUGS, SIDES = 18, 72
"""Treads around a wheel, and corners of its outline."""
GROOVE = 0.05
"""Depth of the grooves between the treads, share of the radius."""
PROFILE = ((-0.44, 0.5), (-0.48, 0.8), (-0.4, 0.96), (-0.25, 1.0), (0.25, 1.0), (0.4, 0.96), (0.48, 0.8), (0.44, 0.5))
"""Of a tyre: places along the axle, share of its width; radius there, share of the wheel's."""
HUB = 0.35
"""Radius of the hub, share of the wheel's."""
AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Part:
    """material: one of the five above. mesh: in the link's frame."""

    material: str
    mesh: Mesh


@lru_cache(maxsize=4)
def display_parts(description: RobotDescription) -> dict[str, tuple[Part, ...]]:
    """Link → its parts. A link whose shape is neither a box nor a wheel is its own shape, but for the chassis."""
    axes = dict(JOINTS)
    parts: dict[str, tuple[Part, ...]] = {}
    for link, mesh in description.meshes.items():
        name = link.split("_", 1)[-1]
        if link == "base":
            parts[link] = _deck(mesh)
        elif name == "wheel":
            parts[link] = _wheel(mesh, description.wheel_radius, description.wheel_width)
        elif name in axes and _is_box(mesh):
            parts[link] = _limb(mesh, AXES[axes[name]])
        else:
            parts[link] = (Part(BEAM, mesh),)
    return parts


def _is_box(mesh: Mesh) -> bool:
    """Whether its vertices are the corners of the box around it."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return len(mesh.vertices) == 8 and bool(((mesh.vertices == low) | (mesh.vertices == high)).all())


def _limb(shape: Mesh, axis: int) -> tuple[Part, ...]:
    """A beam along the longest side, and the joint's housing about its axis through the link's origin."""
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    across = [i for i in range(3) if i != axis]
    radius = float(min(np.minimum(-low, high)[across].min(), 0.5 * (high - low)[across].min()))
    if radius <= 0:
        return (Part(BEAM, _chamfered(low, high)),)
    housing = _turned([(low[axis], 0.85 * radius), (low[axis] + 0.1 * radius, radius)], axis, high[axis])
    slim = np.ones(3)
    slim[axis] = 1.0 if np.argmax(high - low) == axis else SLIM
    middle, half = 0.5 * (low + high), 0.5 * (high - low) * slim
    return Part(BEAM, _chamfered(middle - half, middle + half)), Part(MOTOR, housing)


def _chamfered(low: Array, high: Array) -> Mesh:
    """A box between two corners (3,) with its edges along the longest side cut off, and its ends tapered."""
    size = high - low
    along = int(np.argmax(size))
    one, other = (along + 1) % 3, (along + 2) % 3
    cut = CHAMFER * float(min(size[one], size[other]))
    rings = []
    for place, inset in ((low[along], cut), (low[along] + cut, 0.0), (high[along] - cut, 0.0), (high[along], cut)):
        a, b = ((low[i] + inset / 2, high[i] - inset / 2) for i in (one, other))
        corners = [
            (a[0] + cut, b[0]), (a[1] - cut, b[0]), (a[1], b[0] + cut), (a[1], b[1] - cut),
            (a[1] - cut, b[1]), (a[0] + cut, b[1]), (a[0], b[1] - cut), (a[0], b[0] + cut),
        ]  # fmt: skip
        ring = np.empty((len(corners), 3))
        ring[:, along], ring[:, [one, other]] = place, corners
        rings.append(ring)
    return _skinned(rings)


def _turned(begin: list[tuple[float, float]], axis: int, end: float, sides: int = 20) -> Mesh:
    """Turned about an axis through the origin: (place along it, radius) from one end, mirrored to the other [m]."""
    first = begin[0][0]
    profile = begin + [(end - (place - first), radius) for place, radius in reversed(begin)]
    return _skinned([_ring(axis, place, np.full(sides, radius)) for place, radius in profile])


def _ring(axis: int, place: float, radii: Array) -> Array:
    """Points about an axis, (n, 3), the first on the next axis."""
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    ring = np.empty((len(radii), 3))
    ring[:, axis] = place
    ring[:, (axis + 1) % 3], ring[:, (axis + 2) % 3] = radii * np.cos(angle), radii * np.sin(angle)
    return ring


def _wheel(shape: Mesh, radius: float, width: float) -> tuple[Part, ...]:
    """A tyre with rounded shoulders and treads, and a hub as wide as the wheel.

    The shape's corners are on its radius, so that the tyre is as large as the circle inside them.
    """
    sides = len(shape.vertices) // 2
    inner = radius * float(np.cos(np.pi / sides))
    place = np.arange(SIDES) * LUGS / SIDES % 1.0
    tread = np.where(place < 0.5, 1.0, 1.0 - GROOVE)
    rings = []
    for i, (along, share) in enumerate(PROFILE):
        grooved = tread if 1 < i < len(PROFILE) - 2 else np.ones(SIDES)
        # the treads of both halves are shifted against each other
        rings.append(_ring(1, along * width, inner * share * (grooved if along < 0 else np.roll(grooved, 2))))
    hub = _turned([(-0.5 * width, 0.8 * HUB * inner), (-0.47 * width, HUB * inner)], 1, 0.5 * width)
    long, thick = 1.5 * inner, 0.12 * inner
    spokes = [shapes.box((long, 0.94 * width, thick)), shapes.box((thick, 0.94 * width, long))]
    return Part(TYRE, _skinned(rings)), Part(BEAM, shapes.merged([hub, *spokes]))


def _deck(shape: Mesh) -> tuple[Part, ...]:
    """Upright sides with a cut rim, the deck a little lower, and an arrow on it that points forward."""
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    middle, height = 0.5 * (low + high), high[2] - low[2]
    around = shape.vertices[np.argsort(np.arctan2(shape.vertices[:, 1] - middle[1], shape.vertices[:, 0] - middle[0]))]
    rim, foot = (around[np.isclose(around[:, 2], z)] for z in (high[2], low[2]))
    if len(rim) != len(foot) or len(rim) * 2 != len(shape.vertices):
        return (Part(DECK, shape),)

    def ring(points: Array, share: float, z: float) -> Array:
        inward = middle + share * (points - middle)
        inward[:, 2] = z
        return inward

    sides = _skinned(
        [
            ring(foot, 0.97, low[2]),
            ring(foot, 1.0, low[2] + 0.2 * height),
            ring(rim, 1.0, high[2] - 0.2 * height),
            ring(rim, 0.97, high[2] - 0.04),
        ]
    )
    panel = _skinned([ring(rim, 0.9, high[2] - 0.04), ring(rim, 0.88, high[2] - 0.02)])
    reach = high[0] - middle[0]
    arrow = [(0.62, 0.0), (0.44, 0.12), (0.44, 0.05), (0.2, 0.05), (0.2, -0.05), (0.44, -0.05), (0.44, -0.12)]
    flat = np.column_stack([middle[0] + reach * np.array(arrow), np.full(len(arrow), high[2])])
    return Part(MOTOR, sides), Part(DECK, panel), Part(MARK, _arrow(flat))


def _arrow(corners: Array) -> Mesh:
    """Of a triangle and a shaft, seen from above."""
    return Mesh(corners, np.array([(0, 1, 6), (2, 3, 4), (2, 4, 5)], np.int32))


def _skinned(rings: ArrayLike) -> Mesh:
    """Closed: quads from ring to ring (k, n, 3), counter-clockwise seen from their end, and a fan on both ends."""
    stacked = np.asarray(rings, float)
    count, n, _ = stacked.shape
    triangles = []
    for ring in range(count - 1):
        here = ring * n + np.arange(n)
        beside = ring * n + (np.arange(n) + 1) % n
        triangles += [np.column_stack([here, beside, beside + n]), np.column_stack([here, beside + n, here + n])]
    fan = np.arange(1, n - 1)
    last = (count - 1) * n
    triangles += [
        np.column_stack([np.zeros_like(fan), fan + 1, fan]),
        np.column_stack([np.full_like(fan, last), last + fan, last + fan + 1]),
    ]
    return Mesh(stacked.reshape(-1, 3), np.concatenate(triangles).astype(np.int32))
