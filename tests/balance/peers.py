"""Random stances, and equilibrium asked of a general solver: forces inside facets, all six rows, no projection."""

import numpy as np
from scipy.optimize import linprog

from footfall.balance.cones import facets


def random_stance(rng, feet=None, tilt=0.25):
    """Contacts (k, 3) about a hexagon of 2.3 m and normals tilted by some ``tilt`` [rad], k from 3 to 6."""
    k = int(rng.integers(3, 7)) if feet is None else feet
    angle = np.pi / 3 * np.arange(6)
    contacts = np.column_stack([2.3 * np.cos(angle), 2.3 * np.sin(angle), np.full(6, -1.6)])
    contacts += rng.normal(size=(6, 3)) * [0.3, 0.3, 0.2]
    normals = np.column_stack([rng.normal(size=(6, 2)) * tilt, np.ones(6)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    chosen = np.sort(rng.permutation(6)[:k])
    return contacts[chosen], normals[chosen]


def balance_rows(contacts):
    """(6, 3 k) force and moment about the origin of unit forces on the feet."""
    return np.hstack([np.vstack([np.eye(3), np.cross(point, np.eye(3), axisb=0).T]) for point in contacts])


def facet_rows(normals, friction, sides):
    """(k · sides, 3 k): inside the pyramids where rows · f ≤ 0."""
    faces = facets(normals, friction, sides)
    rows = np.zeros((len(faces) * sides, 3 * len(faces)))
    for foot, face in enumerate(faces):
        rows[sides * foot : sides * foot + sides, 3 * foot : 3 * foot + 3] = -face
    return rows


def is_held(contacts, normals, com_xy, friction, sides=8):
    """Whether any forces hold a centre of mass above com_xy, by HiGHS."""
    rows = facet_rows(normals, friction, sides)
    moment = np.cross([*com_xy, 0.0], [0.0, 0.0, 1.0])
    answer = linprog(
        np.zeros(rows.shape[1]),
        A_ub=rows,
        b_ub=np.zeros(len(rows)),
        A_eq=balance_rows(contacts),
        b_eq=[0.0, 0.0, 1.0, *moment],
        bounds=(None, None),
        method="highs",
    )
    return answer.status == 0


def farthest(contacts, normals, direction, friction, sides=8, most_force=None):
    """How far along a direction (2,) the centre of mass can be, by HiGHS, or None. Unknowns: forces and com_xy."""
    rows = facet_rows(normals, friction, sides)
    rows = np.hstack([rows, np.zeros((len(rows), 2))])
    bounds = np.zeros(len(rows))
    if most_force is not None:
        unit = np.asarray(normals) / np.linalg.norm(normals, axis=1, keepdims=True)
        rows, bounds = np.vstack([rows, np.append(unit.ravel(), [0.0, 0.0])]), np.append(bounds, most_force)
    # Σ p × f − com × (0, 0, 1) = 0
    weight = np.zeros((6, 2))
    weight[3, 1], weight[4, 0] = -1.0, 1.0
    answer = linprog(
        [*np.zeros(3 * len(contacts)), -direction[0], -direction[1]],
        A_ub=rows,
        b_ub=bounds,
        A_eq=np.hstack([balance_rows(contacts), weight]),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        bounds=(None, None),
        method="highs",
    )
    return -answer.fun if answer.status == 0 else None
