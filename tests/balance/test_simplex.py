"""The compiled simplex against HiGHS on random, degenerate, infeasible and unbounded programs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from footfall.balance.cones import facets
from footfall.balance.simplex import INFEASIBLE, OPTIMAL, UNBOUNDED, improve, prices, start
from footfall.balance.torque_kernel import least_ratio


class Program:
    """One program and the arrays that the solver wants for it."""

    def __init__(self, columns, rhs):
        self.columns, self.rhs = np.ascontiguousarray(columns, float), np.asarray(rhs, float)
        m, n = self.columns.shape
        self.basis, self.inverse = np.empty(m, np.int64), np.empty((m, m))
        self.values, self.work = np.empty(m), np.empty(n + 2 * m)

    def start(self):
        return start(self.columns, self.rhs, self.basis, self.inverse, self.values, self.work)

    def maximise(self, cost):
        cost = np.asarray(cost, float)
        status = improve(self.columns, self.rhs, cost, self.basis, self.inverse, self.values, self.work)
        x = np.zeros(self.columns.shape[1])
        own = self.basis < len(x)
        x[self.basis[own]] = self.values[own]
        return status, x

    def prices(self, cost):
        out = np.empty(len(self.rhs))
        prices(self.columns, np.asarray(cost, float), self.basis, self.inverse, out)
        return out


def general(program, cost):
    return linprog(-np.asarray(cost), A_eq=program.columns, b_eq=program.rhs, method="highs")


@pytest.mark.parametrize(("m", "n"), [(1, 3), (3, 8), (5, 41), (13, 120)])
def test_values_agree_with_highs_and_prices_prove_them(rng, m, n):
    solved = 0
    for _ in range(40):
        columns = rng.normal(size=(m, n))
        columns[0] = np.abs(columns[0]) + 0.1  # keeps the program bounded
        x = rng.uniform(0, 1, n) * (rng.uniform(size=n) < 0.5)
        rhs = columns @ x
        columns[rhs < 0] *= -1
        program = Program(columns, np.abs(rhs))
        assert program.start() == OPTIMAL
        for _ in range(3):
            cost = rng.normal(size=n)
            status, found = program.maximise(cost)
            peer = general(program, cost)
            assert status == OPTIMAL
            assert peer.status == 0
            assert cost @ found == pytest.approx(-peer.fun, abs=1e-8 * (1 + abs(peer.fun)))
            assert np.abs(program.columns @ found - program.rhs).max() < 1e-8
            assert found.min() >= 0
            dual = program.prices(cost)
            assert (dual @ program.columns - cost).min() > -1e-8
            assert dual @ program.rhs == pytest.approx(cost @ found, abs=1e-8 * (1 + abs(peer.fun)))
            solved += 1
    assert solved == 120


def test_degenerate_programs_end(rng):
    """Small integers and right-hand sides of zeros: many ties, where the largest gain alone may go in circles."""
    statuses = set()
    for _ in range(300):
        columns = rng.integers(-2, 3, (6, 24)).astype(float)
        columns[5] = rng.integers(0, 2, 24)
        program = Program(columns, [0, 0, 0, 0, 0, 1])
        cost = rng.integers(-3, 4, 24)
        feasible = program.start()
        peer = general(program, cost)
        if feasible == INFEASIBLE:
            assert peer.status == 2
            statuses.add(INFEASIBLE)
            continue
        status, found = program.maximise(cost)
        statuses.add(status)
        # HiGHS may call an unbounded program "unbounded or infeasible"
        assert (peer.status == 0) == (status == OPTIMAL)
        if status == OPTIMAL:
            assert cost @ found == pytest.approx(-peer.fun, abs=1e-9)
    assert statuses == {OPTIMAL, INFEASIBLE, UNBOUNDED}


def test_the_program_that_cycles_with_dantzig_s_rule():
    """Beale's example: six degenerate pivots lead back to the start."""
    columns = np.array(
        [
            [0.25, -8.0, -1.0, 9.0, 1.0, 0.0, 0.0],
            [0.5, -12.0, -0.5, 3.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        ]
    )
    program = Program(columns, [0, 0, 1])
    assert program.start() == OPTIMAL
    cost = [0.75, -20, 0.5, -6, 0, 0, 0]
    status, found = program.maximise(cost)
    assert status == OPTIMAL
    assert np.dot(cost, found) == pytest.approx(1.25)


def test_bounds_that_all_but_meet_are_solved():
    """Torques of a rover on level ground, 4200 km from the origin: feet are alike but for the rounding of places."""
    with np.load(Path(__file__).with_name("level_far_away.npz")) as one:
        arms, effect, constant = one["arms"], one["effect"], one["constant"]
    faces = facets(np.tile([0.0, 0.0, 1.0], (len(arms), 1)), 0.2, 8)

    status, ratio = least_ratio(arms, faces, effect, constant, np.empty(arms.shape))

    assert status == OPTIMAL
    assert ratio == pytest.approx(_ratio_by_highs(arms, faces, effect, constant), abs=1e-8)


def _ratio_by_highs(arms, faces, effect, constant):
    """Over the forces themselves: of each foot in turn, and the ratio last."""
    feet = len(arms)
    shares, inside = np.zeros((6 * feet, 3 * feet)), np.zeros((faces.shape[1] * feet, 3 * feet))
    for foot in range(feet):
        own = slice(3 * foot, 3 * foot + 3)
        shares[6 * foot : 6 * foot + 6, own] = effect[foot]
        inside[faces.shape[1] * foot : faces.shape[1] * (foot + 1), own] = faces[foot]
    ones = np.ones((len(shares), 1))
    balance = np.hstack([np.vstack([np.eye(3), np.cross(arm, np.eye(3), axisb=0).T]) for arm in arms])
    found = linprog(
        np.append(np.zeros(3 * feet), 1.0),
        A_ub=np.block([[shares, -ones], [-shares, -ones], [-inside, np.zeros((len(inside), 1))]]),
        b_ub=np.concatenate([-constant.ravel(), constant.ravel(), np.zeros(len(inside))]),
        A_eq=np.hstack([balance, np.zeros((6, 1))]),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        bounds=(None, None),
        method="highs",
    )
    return found.fun


def test_a_redundant_row_does_no_harm(rng):
    columns = rng.uniform(0.1, 1.0, (3, 10))
    columns = np.vstack([columns, columns[0] + columns[1]])
    program = Program(columns, columns @ np.full(10, 0.3))
    assert program.start() == OPTIMAL
    cost = rng.normal(size=10)
    status, found = program.maximise(cost)
    assert status == OPTIMAL
    assert cost @ found == pytest.approx(-general(program, cost).fun, abs=1e-9)


def test_infeasible_and_unbounded_are_told():
    assert Program([[1.0, 1.0], [1.0, 1.0]], [1, 2]).start() == INFEASIBLE
    program = Program([[1.0, -1.0, 0.0]], [1])
    assert program.start() == OPTIMAL
    assert program.maximise([0, 0, 1])[0] == UNBOUNDED


def test_buffers_that_do_not_fit_are_refused():
    program = Program(np.ones((2, 3)), [1, 1])
    program.work = np.empty(3)
    with pytest.raises(ValueError, match="don't fit"):
        program.start()
