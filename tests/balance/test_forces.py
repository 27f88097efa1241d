"""Contact forces: equilibrium, friction, and optimality against a general solver."""

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from footfall.balance.balance_settings import SIDES
from footfall.balance.cones import facets, generators
from footfall.balance.forces import distribute, equilibrium_matrix
from footfall.core.errors import InvalidInput

WEIGHT = 850 * 9.81
FRICTION = 0.6


def stances(rng, count):
    angle = np.pi / 3 * np.arange(6)
    for _ in range(count):
        k = int(rng.integers(3, 7))
        feet = np.column_stack([2.3 * np.cos(angle), 2.3 * np.sin(angle), np.full(6, -1.6)])
        feet += rng.normal(size=(6, 3)) * [0.3, 0.3, 0.2]
        normals = np.column_stack([rng.normal(size=(6, 2)) * 0.25, np.ones(6)])
        chosen = np.sort(rng.permutation(6)[:k])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        yield feet[chosen], normals[chosen], rng.normal(size=3) * [0.5, 0.5, 0.1]


def test_generators_and_facets_describe_the_same_pyramid_inside_the_cone(rng):
    normals = rng.normal(size=(20, 3))
    edges, faces = generators(normals, FRICTION), facets(normals, FRICTION)
    inner = np.einsum("kfc,kgc->kfg", faces, edges)
    assert inner.min() > -1e-12
    # each face holds exactly two edges
    assert ((np.abs(inner) < 1e-12).sum(axis=2) == 2).all()
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.einsum("kgc,kc->kg", edges, unit)
    across = np.linalg.norm(edges - along[..., None] * unit[:, None], axis=2)
    assert (across <= FRICTION * along + 1e-12).all()
    assert edges.shape == (20, SIDES, 3)


def test_forces_hold_the_rover_inside_friction(rng):
    held = 0
    for contacts, normals, com in stances(rng, 150):
        forces = distribute(contacts, normals, com, 850.0, friction=FRICTION)
        if forces is None:
            continue
        held += 1
        assert np.abs(forces.sum(axis=0) - [0, 0, WEIGHT]).max() <= 1e-6 * WEIGHT
        assert np.abs(np.cross(contacts - com, forces).sum(axis=0)).max() <= 1e-6 * WEIGHT * 3
        along = np.einsum("kc,kc->k", forces, normals)
        across = np.linalg.norm(forces - along[:, None] * normals, axis=1)
        assert (across <= FRICTION * along + 1e-5 * WEIGHT).all()
    assert held > 60


def test_none_exactly_where_a_linear_program_finds_no_forces(rng):
    answers = []
    for contacts, normals, com in stances(rng, 150):
        edges = generators(normals, FRICTION).reshape(-1, 3)
        k = len(contacts)
        spread = np.zeros((3 * k, len(edges)))
        for column, edge in enumerate(edges):
            foot = column // SIDES
            spread[3 * foot : 3 * foot + 3, column] = edge
        solved = linprog(
            np.zeros(len(edges)),
            A_eq=equilibrium_matrix(contacts, com) @ spread,
            b_eq=[0, 0, 1, 0, 0, 0],
            method="highs",
        )
        found = distribute(contacts, normals, com, 850.0, friction=FRICTION) is not None
        assert found == (solved.status == 0)
        answers.append(found)
    assert 0.2 < np.mean(answers) < 0.95


@pytest.mark.parametrize("given", [False, True])
def test_no_other_forces_have_a_smaller_norm_or_are_nearer(rng, given):
    compared = 0
    for contacts, normals, com in stances(rng, 25):
        near = rng.normal(size=contacts.shape) * 0.3 if given else np.zeros_like(contacts)
        forces = distribute(contacts, normals, com, 850.0, friction=FRICTION, near=WEIGHT * near if given else None)
        if forces is None:
            continue
        near = near.ravel()
        balance = equilibrium_matrix(contacts, com)
        faces = facets(normals, FRICTION)

        def insides(f, faces=faces):
            return np.einsum("ksc,kc->ks", faces, f.reshape(-1, 3)).ravel()

        general = minimize(
            lambda f, near=near: (f - near) @ (f - near),
            np.tile([0, 0, 1 / len(contacts)], len(contacts)),
            jac=lambda f, near=near: 2 * (f - near),
            constraints=[
                {"type": "eq", "fun": lambda f, b=balance: b @ f - [0, 0, 1, 0, 0, 0]},
                {"type": "ineq", "fun": insides},
            ],
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 300},
        )
        ours = (forces / WEIGHT).ravel()
        if general.success and np.abs(balance @ general.x - [0, 0, 1, 0, 0, 0]).max() < 1e-9:
            compared += 1
            assert (ours - near) @ (ours - near) <= general.fun + 1e-6
            assert np.abs(ours - general.x).max() < 1e-3
    assert compared > 5


def test_forces_that_hold_the_rover_already_stay(rng):
    """Also where others are smaller: what is squeezed between two wheels is no reason to change."""
    kept = 0
    for contacts, normals, com in stances(rng, 60):
        narrow = distribute(contacts, normals, com, 850.0, friction=0.7 * FRICTION)
        if narrow is None:
            continue
        right = np.linalg.svd(equilibrium_matrix(contacts, com))[2]
        squeezed = narrow + 0.01 * WEIGHT * (rng.normal(size=len(right) - 6) @ right[6:]).reshape(-1, 3)
        if (np.einsum("ksc,kc->ks", facets(normals, FRICTION), squeezed) < 0).any():
            continue
        kept += 1
        found = distribute(contacts, normals, com, 850.0, friction=FRICTION, near=squeezed)
        assert found == pytest.approx(squeezed, abs=1e-6 * WEIGHT)
    assert kept > 10


def test_a_symmetric_stance_shares_the_weight_evenly():
    angle = np.pi / 3 * np.arange(6)
    contacts = np.column_stack([np.cos(angle), np.sin(angle), np.full(6, -1.5)])
    forces = distribute(contacts, np.tile([0, 0, 1.0], (6, 1)), np.zeros(3), 850.0)
    assert forces == pytest.approx(np.tile([0, 0, WEIGHT / 6], (6, 1)), abs=1e-6)


def test_gravity_scales_forces_and_too_little_friction_gives_none():
    contacts = np.array([[1, 0, 0], [-1, 1, 0], [-1, -1, 0.0]])
    steep = np.tile([np.sin(0.4), 0, np.cos(0.4)], (3, 1))
    assert distribute(contacts, steep, [0, 0, 1], 850.0, friction=0.3) is None
    earth = distribute(contacts, steep, [0, 0, 1], 850.0, friction=0.8)
    moon = distribute(contacts, steep, [0, 0, 1], 850.0, gravity=1.62, friction=0.8)
    assert earth is not None
    assert moon is not None
    assert moon == pytest.approx(earth * 1.62 / 9.81)


def test_a_centre_of_mass_outside_the_feet_and_too_few_feet_give_none():
    contacts = np.array([[1, 0, 0], [-1, 1, 0], [-1, -1, 0.0]])
    up = np.tile([0, 0, 1.0], (3, 1))
    assert distribute(contacts, up, [1.2, 0, 1], 850.0) is None
    assert distribute(contacts[:2], up[:2], [1, 2, 1], 850.0) is None
    assert distribute(contacts[:0], up[:0], [0, 0, 1], 850.0) is None
    one = distribute(contacts[:1], up[:1], [1, 0, 1], 850.0)
    assert one == pytest.approx(np.array([[0, 0, WEIGHT]]))


def test_bad_input_is_refused_by_name():
    contacts, up = np.eye(3), np.tile([0, 0, 1.0], (3, 1))
    with pytest.raises(InvalidInput, match="contacts"):
        distribute(contacts * np.nan, up, [0, 0, 1], 850.0)
    with pytest.raises(InvalidInput, match="one normal"):
        distribute(contacts, up[:2], [0, 0, 1], 850.0)
    with pytest.raises(InvalidInput, match="to stay near to"):
        distribute(contacts, up, [0, 0, 1], 850.0, near=np.zeros((2, 3)))
    with pytest.raises(InvalidInput, match="friction"):
        distribute(contacts, up, [0, 0, 1], 850.0, friction=0.0)
    with pytest.raises(InvalidInput, match="mass"):
        distribute(contacts, up, [0, 0, 1], -1.0)
    with pytest.raises(InvalidInput, match="normal"):
        distribute(contacts, up * 0, [0, 0, 1], 850.0)
