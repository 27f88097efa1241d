"""What the rover looks like takes no more room than what collisions are checked with, and leaves little of it out."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull, KDTree

from footfall.core.mesh import Mesh
from footfall.robot.description import PARTS, link_name
from footfall.robot.meshes.display import FARTHEST, LUGS, MARK, RUBBER, Part, display_parts

SPACING = 0.01
"""Of the points on a shape that are looked at, and by how much a nearest point may be missed [m]."""


@pytest.fixture(scope="module")
def parts(athlete):
    return display_parts(athlete.description)


def one_of_each(parts):
    """Links that differ: the legs are alike."""
    return {link: found for link, found in parts.items() if link == "base" or link.startswith("leg0_")}


def points_on(mesh, spacing):
    """Points of all triangles, no place of the surface farther than ``spacing`` from one."""
    found = []
    for a, b, c in mesh.vertices[mesh.triangles]:
        count = int(np.ceil(max(np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b)) / spacing)) + 1
        u, v = (one.ravel() for one in np.meshgrid(*[np.linspace(0, 1, count)] * 2))
        inside = u + v <= 1 + 1e-9
        found.append(a + u[inside, None] * (b - a) + v[inside, None] * (c - a))
    return np.concatenate(found)


def test_every_part_lies_inside_the_shape_that_is_checked_and_reaches_its_sides(athlete, parts):
    assert set(parts) == set(athlete.description.meshes)
    for link, shape in athlete.description.meshes.items():
        corners = np.concatenate([part.mesh.vertices for part in parts[link]])
        planes = ConvexHull(shape.vertices).equations
        assert (corners @ planes[:, :3].T + planes[:, 3]).max() < 1e-9, link
        assert corners.min(axis=0) == pytest.approx(shape.vertices.min(axis=0), abs=0.02), link
        assert corners.max(axis=0) == pytest.approx(shape.vertices.max(axis=0), abs=0.02), link


def test_no_place_of_a_shape_that_is_checked_is_far_from_what_is_drawn(athlete, parts):
    """A wheel is locked in its fork, and fills it."""
    description = athlete.description
    for link, found in one_of_each(parts).items():
        drawn = [part.mesh for part in found]
        if link.endswith("ankle_roll"):
            along = np.array([description.legs[0].foot, 0.0, 0.0])
            wheel = parts[link_name(0, "wheel")]
            drawn += [Mesh(part.mesh.vertices + along, part.mesh.triangles) for part in wheel]
        near = KDTree(np.concatenate([points_on(mesh, SPACING) for mesh in drawn]))
        far, _ = near.query(points_on(description.meshes[link], 2 * SPACING))
        assert far.max() < FARTHEST + SPACING, link


def test_parts_are_closed_and_seen_from_outside(parts):
    for link, found in one_of_each(parts).items():
        for part in found:
            if part.material == MARK:
                continue
            solid = trimesh.Trimesh(part.mesh.vertices, part.mesh.triangles)
            for piece in solid.split(only_watertight=False):
                assert piece.is_watertight, (link, part.material)
                assert piece.volume > 0, (link, part.material)


def test_links_that_are_built_alike_share_their_parts(parts):
    for leg in range(1, 6):
        for part in PARTS:
            assert parts[link_name(leg, part)] is parts[link_name(0, part)]
    assert len({id(found) for found in parts.values()}) == 1 + len(PARTS)


def test_a_wheel_is_round_with_treads(athlete, parts):
    (tyre,) = (part.mesh for part in parts[link_name(0, "wheel")] if part.material == RUBBER)
    middle = tyre.vertices[np.abs(tyre.vertices[:, 1] - 0.02 * athlete.description.wheel_width) < 1e-6]
    radius, angle = np.hypot(middle[:, 0], middle[:, 2]), np.arctan2(middle[:, 0], middle[:, 2])
    high = radius[np.argsort(angle)] > radius.mean()
    assert np.count_nonzero(high & ~np.roll(high, 1)) == LUGS
    assert radius.max() > 0.98 * athlete.wheel_radius


def test_a_fork_leaves_room_for_its_wheel(athlete, parts):
    """Between the plates there is nothing where the wheel is."""
    description = athlete.description
    corners = np.concatenate([part.mesh.vertices for part in parts[link_name(0, "ankle_roll")]])
    away = np.hypot(corners[:, 0] - description.legs[0].foot, corners[:, 2])
    inside = (away < description.wheel_radius - 1e-6) & (np.abs(corners[:, 1]) < 0.5 * description.wheel_width)
    assert not inside.any()
    assert (away < 0.5 * description.wheel_radius).any()


def test_the_mark_on_the_deck_points_forward(parts):
    (arrow,) = (part.mesh for part in parts["base"] if part.material == MARK)
    tip = arrow.vertices[np.argmax(arrow.vertices[:, 0])]
    assert tip[0] > 0
    assert tip[1] == pytest.approx(0.0)
    assert arrow.vertices[:, 2] == pytest.approx(max(part.mesh.vertices[:, 2].max() for part in parts["base"]))
    a, b, c = (arrow.vertices[arrow.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_a_limb_of_another_shape_is_its_own_shape(athlete):
    """A slanted box has corners where the straight box around it has none."""
    box = athlete.description.meshes["leg0_hip_pitch"]
    slanted = trimesh.transform_points(box.vertices, trimesh.transformations.euler_matrix(0, 0.4, 0))
    mesh = Mesh(slanted, box.triangles)
    fields = {name: getattr(athlete.description, name) for name in athlete.description.__dataclass_fields__}
    other = type(athlete.description)(**{**fields, "meshes": {**athlete.description.meshes, "leg0_hip_pitch": mesh}})
    found = display_parts(other)
    (part,) = found["leg0_hip_pitch"]
    assert isinstance(part, Part)
    assert part.mesh is mesh
    assert found["leg1_hip_pitch"] != found["leg0_hip_pitch"]
