"""Clearing an area of the terrain, and going back to an earlier one."""

import pytest

from tests.support.problems import problem


def test_terrain_cleared_and_undone(client):
    session = client.post("/sessions", json={"name": "to clear"}).json()["id"]
    path = f"/sessions/{session}/terrains"
    problem(client.post(f"{path}/clear", json={"center": [0.0, 0.0], "radius": 1.0}), 409, "conflict")
    problem(client.post(f"{path}/undo"), 409, "conflict")
    grid = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n4 5 6\n7 8 9\n"
    loaded = client.post(path, files={"file": ("g.asc", grid, "text/plain")}).json()
    cleared = client.post(f"{path}/clear", json={"center": [1.5, 1.5], "radius": 0.2})
    assert cleared.status_code == 201
    assert cleared.json()["known"] == pytest.approx(8 / 9)
    assert cleared.headers["Location"].endswith(f"/terrains/{cleared.json()['digest']}")
    corners = [[-0.5, -0.5], [1.0, -0.5], [1.0, 1.0], [-0.5, 1.0]]
    again = client.post(f"{path}/clear", json={"corners": corners}).json()
    assert again["known"] == pytest.approx(7 / 9)
    assert client.post(f"{path}/undo").json()["digest"] == cleared.json()["digest"]
    assert client.post(f"{path}/undo").json()["digest"] == loaded["digest"]
    assert client.get(f"{path}/current").json()["digest"] == loaded["digest"]
    for wrong in ({}, {"center": [0, 0]}, {"center": [0.0, 0.0], "radius": -1.0}, {"corners": [[0.0, 0.0]]}):
        assert client.post(f"{path}/clear", json=wrong).status_code == 422
