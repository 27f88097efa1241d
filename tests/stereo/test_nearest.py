import numpy as np
from trimesh.triangles import closest_point

from footfall.robot.meshes.shapes import box
from footfall.terrain.rover_mask.nearest import nearest_triangles


def triangles(rng, n: int) -> tuple[np.ndarray, np.ndarray]:
    corners = rng.uniform(-1.0, 1.0, (n, 1, 3)) + rng.uniform(-0.3, 0.3, (n, 3, 3))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_the_nearest_of_many_triangles_agrees_with_asking_each(rng):
    """Each triangle by itself with trimesh, the second method; parts of uneven size, one of them empty."""
    corners, normals = triangles(rng, 60)
    first = np.array([0, 7, 7, 30, 60])
    points = rng.uniform(-1.5, 1.5, (400, 3))
    facing = rng.normal(size=(400, 3))
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    found, at = nearest_triangles(points, facing, corners, normals, first, 0.5, 0.3)
    each = np.stack([closest_point(np.repeat(one[None], 400, axis=0), points) for one in corners], axis=1)
    away = np.linalg.norm(each - points[:, None], axis=-1)
    away[facing @ normals.T < 0.3] = np.inf
    best = away.min(axis=1)
    assert np.array_equal(found >= 0, best < 0.5)
    assert 50 < (found >= 0).sum() < 350
    hit = found >= 0
    assert np.allclose(np.linalg.norm(at - points, axis=1)[hit], best[hit], atol=1e-9)
    assert np.allclose(at[hit], each[np.arange(400), found][hit], atol=1e-9)


def test_a_point_is_given_to_the_face_that_looks_its_way(rng):
    """Just inside of an edge of a box the other face is as near, but looks elsewhere."""
    solid = box((1.0, 1.0, 1.0))
    corners = solid.vertices[solid.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    point = np.array([[0.45, 0.0, 0.49]])
    for facing in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]):
        found, at = nearest_triangles(point, np.array([facing]), corners, normals, np.array([0, 12]), 0.2, 0.5)
        assert normals[found[0]] @ facing > 0.99
        assert np.allclose(at[0] @ facing, 0.5)


def test_no_triangle_in_reach_is_told(rng):
    corners, normals = triangles(rng, 5)
    found, _ = nearest_triangles(np.full((3, 3), 9.0), normals[:3], corners, normals, np.array([0, 5]), 1.0, -1.0)
    assert (found == -1).all()
    found, _ = nearest_triangles(np.zeros((0, 3)), np.zeros((0, 3)), corners, normals, np.array([0, 5]), 1.0, -1.0)
    assert len(found) == 0
