"""Ball trees cover the surfaces that they were made for: checked with samples that the construction never saw."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from footfall.core.mesh import Mesh
from footfall.robot.description import PARTS
from footfall.robot.meshes import shapes
from footfall.robot.meshes.bvh import TOUCHING_WHEEL, robot_meshes
from footfall.robot.proof.cover import ball_tree, cut


def surface_samples(mesh, count, rng):
    """Points of the surface in proportion to area, with all corners and points on every edge."""
    corners = mesh.vertices[mesh.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weights = rng.dirichlet(np.ones(3), count)
    inside = (weights[:, :, None] * corners[rng.choice(len(area), count, p=area / area.sum())]).sum(axis=1)
    along = rng.uniform(size=(20, 1, 1))
    edges = [along * corners[:, k] + (1 - along) * corners[:, (k + 1) % 3] for k in range(3)]
    return np.concatenate([inside, mesh.vertices, *(e.reshape(-1, 3) for e in edges)])


def covered(points, centers, radii):
    distance = np.linalg.norm(points[:, None] - centers[None], axis=2)
    return (distance <= radii).any(axis=1)


def walk(tree, clear):
    """The balls that a walk rests on when the balls that are ``clear`` say so; leaves count as clear."""
    used, ball = [], 0
    while ball < len(tree.radii):
        if clear[ball] or tree.leaves[ball]:
            used.append(ball)
            ball = tree.skip[ball]
        else:
            ball += 1
    return used


MESHES = {
    "tilted box": shapes.box((0.5, 0.1, 0.3), (0.2, 0.0, -0.1)),
    "odd prism": shapes.prism(5, 0.6, 0.3, (0.1, 0.2, 0.0)),
    "many-sided prism": shapes.prism(30, 0.5, 0.2),
    "eccentric drum": shapes.cylinder_y(0.2, 0.3, 20, (0.02, 0.5, 0.0)),
    "thin sheet": shapes.box((0.4, 0.4, 0.001)),
}


@pytest.mark.parametrize("name", [*PARTS, TOUCHING_WHEEL, *MESHES])
def test_every_walk_ends_on_a_cover(athlete, rng, name):
    mesh = MESHES[name] if name in MESHES else robot_meshes(athlete.description)[name]
    if name == "tilted box":
        turn = Rotation.from_euler("xyz", (0.4, 1.0, -0.7)).as_matrix()
        mesh = Mesh(mesh.vertices @ turn.T, mesh.triangles)
    tree = ball_tree(mesh)
    points = surface_samples(mesh, 4000, rng)
    for share in (0.0, 0.3, 0.7, 1.0):
        used = walk(tree, rng.uniform(size=len(tree.radii)) < share)
        assert covered(points, tree.centers[used], tree.radii[used]).all()
    assert walk(tree, np.ones(len(tree.radii), bool)) == [0]


def test_a_cover_in_more_levels_is_one(athlete, rng):
    mesh, edges = robot_meshes(athlete.description)["base"], (0.7, 0.3, (0.1, 0.1, 0.25))
    tree = ball_tree(mesh, edges)
    points = surface_samples(mesh, 3000, rng)
    for share in (0.0, 0.3, 0.7):
        used = walk(tree, rng.uniform(size=len(tree.radii)) < share)
        assert covered(points, tree.centers[used], tree.radii[used]).all()
    # a ball of each level holds a cell with edges no longer than was said
    cells = [np.linalg.norm(np.broadcast_to(edge, 3)) / 2 for edge in edges]
    assert tree.radii[1:].max() <= cells[0] + 1e-5
    assert tree.radii[tree.leaves].max() <= cells[-1] + 1e-5
    assert tree.leaves.sum() > 0.7 * len(tree.radii) > 400


def test_a_cover_is_as_tight_as_its_pieces(athlete):
    # a ball that could be smaller would be no error, but it would be no computed radius either
    mesh = robot_meshes(athlete.description)["wheel"]
    tree = ball_tree(mesh)
    farthest = np.linalg.norm(mesh.vertices - tree.centers[0], axis=1).max()
    assert tree.radii[0] == pytest.approx(farthest, abs=2e-6)
    slabs = tree.radii[~tree.leaves][1:]
    # a ball on the axle that covers a slab hardly stands out beyond the rim
    assert len(slabs) == 4
    assert slabs.max() < athlete.wheel_radius + 0.002


def test_trees_are_in_preorder(athlete):
    tree = ball_tree(robot_meshes(athlete.description)["ankle_roll"])
    assert tree.skip[0] == len(tree.skip)
    for ball, end in enumerate(tree.skip):
        assert ball < end
        assert (tree.skip[ball:end] <= end).all()


def test_cuts_keep_the_surface(rng):
    triangles = rng.normal(size=(200, 3, 3))
    normal, offset = np.array([0.6, 0.0, 0.8]), 0.1
    pieces = cut(triangles, normal, offset)

    def area(t):
        return np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2

    assert area(pieces) == pytest.approx(area(triangles), rel=1e-12)
    side = pieces @ normal - offset
    assert ((side.max(axis=1) <= 1e-9) | (side.min(axis=1) >= -1e-9)).all()
    assert len(pieces) > len(triangles)
    # cut away from all of them: nothing happens
    assert np.array_equal(cut(triangles, normal, 1e3), triangles)
