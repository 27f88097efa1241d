"""The rover as it is drawn: materials, sharp edges, and batches of links that are coloured apart."""

from dataclasses import replace

import numpy as np
import pytest
import viser

import footfall
from footfall.core.frames import quat_wxyz
from footfall.robot.kinematics import link_poses
from footfall.robot.meshes.display import DARK, FOIL, METAL, PAINT, display_parts
from footfall.robot.meshes.rounded import drum
from footfall.robot.meshes.shapes import box
from footfall_ui.scene.painted import PAINTS, creased, normals_of, painted_glb
from footfall_ui.scene.robot import CHOSEN, COLLIDING, GHOST, RobotDrawing, leg_links
from footfall_ui.scene.torque import LEVELS, TorqueDrawing, ball
from tests.support.chassis_ground import wavy
from tests.support.glb import loaded


@pytest.fixture
def server():
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def test_sharp_edges_stay_sharp_and_round_ones_round():
    """A drum's side faces away from its axis, its flat ends along it."""
    plain = drum(-0.2, 0.2, 0.1, axis=2)
    mesh = creased(plain)
    assert mesh.vertices[mesh.triangles] == pytest.approx(plain.vertices[plain.triangles])
    normals = normals_of(mesh)
    corners = mesh.vertices[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    side, end = np.abs(faces[:, 2]) < 1e-6, np.abs(faces[:, 2]) > 1 - 1e-6
    assert np.count_nonzero(side) == np.count_nonzero(end) + 4 == 48
    for i in range(3):
        there = mesh.triangles[:, i]
        outward = mesh.vertices[there] * (1.0, 1.0, 0.0) / np.hypot(*mesh.vertices[there, :2].T)[:, None]
        assert (normals[there] * outward)[side].sum(axis=1).min() > 0.95
        assert (normals[there] * faces)[end].sum(axis=1).min() > 0.9
    assert len(mesh.vertices) == len(plain.vertices)


def test_the_edges_of_a_box_are_sharp():
    mesh = creased(box((1.0, 2.0, 3.0)))
    assert len(mesh.vertices) == 24
    assert np.abs(normals_of(mesh)).max(axis=1) == pytest.approx(1.0)


def test_each_part_has_the_material_that_it_is_made_of(athlete):
    parts = display_parts(athlete.description)
    assert {part.material for found in parts.values() for part in found} == set(PAINTS)
    assert PAINTS[DARK].metal > PAINTS[PAINT].metal
    for metal in (METAL, FOIL):
        assert PAINTS[metal].metal > 0.5
    for link in ("base", "leg0_wheel"):
        mesh = loaded(painted_glb(parts[link]))
        material = mesh.visual.material
        shown = np.asarray(material.baseColorTexture.convert("RGB"))
        surfaces = np.asarray(material.metallicRoughnessTexture.convert("RGB"))
        texel = np.floor(mesh.visual.uv[:, 0] * len(PAINTS)).astype(int)
        first = 0
        for part in parts[link]:
            paint = PAINTS[part.material]
            area = slice(first, first + len(part.mesh.triangles))
            first = area.stop
            (number,) = set(texel[mesh.faces[area]].ravel().tolist())
            assert tuple(shown[0, number]) == paint.color
            assert surfaces[0, number, 1] / 255 == pytest.approx(paint.rough, abs=0.003)
            assert surfaces[0, number, 2] / 255 == pytest.approx(paint.metal, abs=0.003)
            assert mesh.vertices[mesh.faces[area]] == pytest.approx(part.mesh.vertices[part.mesh.triangles], abs=1e-6)
        assert first == len(mesh.faces)


def drawn_links(server, robot, posture, name="rover"):
    """Link → the name of the batch that shows it, found by where it is."""
    poses, found = link_poses(robot, posture), {}
    for batch in (one for one in server.scene._handle_from_node_name.values() if one.name.startswith(f"/{name}/")):
        if not batch.visible or not hasattr(batch, "batched_positions"):
            continue
        part = batch.name.split("/")[2].split("-")[0]
        for turn, at in zip(batch.batched_wxyzs, batch.batched_positions, strict=True):
            for link, T in poses.items():
                alike = link.split("_", 1)[-1] == part and np.abs(T[:3, 3] - at).max() < 1e-6
                if alike and abs(abs(quat_wxyz(T[:3, :3]) @ turn) - 1) < 1e-6:
                    assert link not in found, f"{link} is drawn twice"
                    found[link] = batch.name
    return found


def test_each_link_is_drawn_once_in_its_colour(server, athlete):
    posture = np.array(athlete.description.postures["stand"])
    drawing = RobotDrawing(server, athlete)
    drawing.place(posture, np.eye(4))
    plain = drawn_links(server, athlete, posture)
    assert set(plain) == set(athlete.description.meshes)
    chosen, red = leg_links(athlete, 2), {"leg3_wheel", "base"}
    drawing.highlight(chosen, red)
    told = drawn_links(server, athlete, posture)
    assert set(told) == set(plain)
    for link, batch in told.items():
        tint = COLLIDING if link in red else CHOSEN if link in chosen else None
        assert batch == plain[link] + ("" if tint is None else "-" + "-".join(map(str, tint)))
    posture[12] += 0.3  # the chosen leg goes on in its colour
    drawing.place(posture, np.eye(4))
    assert drawn_links(server, athlete, posture) == told
    drawing.highlight(set())
    assert drawn_links(server, athlete, posture) == plain


def test_a_copy_of_one_leg_is_see_through_and_goes_with_its_root(server, athlete):
    posture = np.array(athlete.description.postures["stand"])
    drawing = RobotDrawing(server, athlete, "ghost", leg_links(athlete, 1), GHOST, opacity=0.5)
    drawing.place(posture, np.eye(4))
    assert set(drawn_links(server, athlete, posture, "ghost")) == leg_links(athlete, 1)
    wheel = server.scene.get_handle_by_name("/ghost/wheel")
    assert isinstance(wheel, viser.BatchedMeshHandle)
    assert wheel.opacity == 0.5
    assert tuple(np.asarray(wheel.batched_colors)) == GHOST
    drawing.remove()
    assert server.scene.get_handle_by_name("/ghost/wheel") is None


def test_every_joint_has_a_ball_of_its_level(server, athlete):
    stood = footfall.stand(athlete, wavy(half=4.0))
    drawing = TorqueDrawing(server, athlete)
    for shares, counts in (({}, (36, 0, 0)), ({14: 0.9, 3: 1.2}, (34, 1, 1)), ({14: 0.9, 15: 0.9}, (34, 2, 0))):
        torques = 0.1 * athlete.torque_limits
        for joint, share in shares.items():
            torques[joint] = -share * athlete.torque_limits[joint]
        state = replace(stood, joint_torques=torques)
        drawing.show(state)
        poses = link_poses(athlete, state.posture)
        for name, count in zip(LEVELS, counts, strict=True):
            batch = server.scene.get_handle_by_name(f"/rover/torques/{name}")
            assert (0 if batch is None else len(batch.batched_positions)) == count
        if 14 in shares:
            warned = server.scene.get_handle_by_name("/rover/torques/warn").batched_positions
            assert warned[0] == pytest.approx(poses["leg2_knee_pitch"][:3, 3], abs=1e-6)
    drawing.hide()
    assert server.scene.get_handle_by_name("/rover/torques/good") is None


def test_a_ball_is_round():
    mesh = ball(0.2)
    away = np.linalg.norm(mesh.vertices, axis=1)
    assert away == pytest.approx(0.2)
    volume = np.linalg.det(mesh.vertices[mesh.triangles]).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 0.2**3, rel=0.1)
