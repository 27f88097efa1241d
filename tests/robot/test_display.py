"""What the rover looks like takes no more room than what collisions are checked with, and is as large."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from footfall.core.mesh import Mesh
from footfall.robot.description import PARTS, link_name
from footfall.robot.display import LUGS, MARK, TYRE, display_parts


@pytest.fixture(scope="module")
def parts(athlete):
    return display_parts(athlete.description)


def test_every_part_lies_inside_the_shape_that_is_checked_and_reaches_its_sides(athlete, parts):
    assert set(parts) == set(athlete.description.meshes)
    for link, shape in athlete.description.meshes.items():
        corners = np.concatenate([part.mesh.vertices for part in parts[link]])
        planes = ConvexHull(shape.vertices).equations
        assert (corners @ planes[:, :3].T + planes[:, 3]).max() < 1e-9, link
        assert corners.min(axis=0) == pytest.approx(shape.vertices.min(axis=0), abs=0.02), link
        assert corners.max(axis=0) == pytest.approx(shape.vertices.max(axis=0), abs=0.02), link


def test_parts_are_closed_and_seen_from_outside(parts):
    for link, found in parts.items():
        assert len({part.material for part in found}) == len(found), link
        for part in found:
            if part.material == MARK:
                continue
            solid = trimesh.Trimesh(part.mesh.vertices, part.mesh.triangles)
            for piece in solid.split(only_watertight=False):
                assert piece.is_watertight, (link, part.material)
                assert piece.volume > 0, (link, part.material)


def test_a_wheel_is_round_with_treads(athlete, parts):
    for leg in athlete.legs:
        (tyre,) = (part.mesh for part in parts[link_name(leg, "wheel")] if part.material == TYRE)
        middle = tyre.vertices[np.abs(tyre.vertices[:, 1] - 0.25 * athlete.description.wheel_width) < 1e-6]
        radius, angle = np.hypot(middle[:, 0], middle[:, 2]), np.arctan2(middle[:, 0], middle[:, 2])
        high = radius[np.argsort(angle)] > radius.mean()
        assert np.count_nonzero(high & ~np.roll(high, 1)) == LUGS
        assert radius.max() > 0.98 * athlete.wheel_radius


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
    turned = Mesh(
        trimesh.transform_points(box.vertices, trimesh.transformations.euler_matrix(0, 0.4, 0)), box.triangles
    )
    fields = {name: getattr(athlete.description, name) for name in athlete.description.__dataclass_fields__}
    other = type(athlete.description)(**{**fields, "meshes": {**athlete.description.meshes, "leg0_hip_pitch": turned}})
    (part,) = display_parts(other)["leg0_hip_pitch"]
    assert part.mesh is turned


def test_all_of_it_is_small(parts):
    """A page is sent it once, and each ghost of the whole rover again."""
    meshes = [part.mesh for found in parts.values() for part in found]
    assert sum(12 * (len(mesh.vertices) + len(mesh.triangles)) for mesh in meshes) < 300_000
    assert {name for name in parts if name != "base"} == {link_name(leg, part) for leg in range(6) for part in PARTS}
