"""Klampt's SBL on our problems: the planner that ATHLETE's first step planner was built with, on the same robot.

Its robot is our URDF with our meshes, its ground our triangles raised by the same height, its margins our δ for the
same pairs of links. What our search asks beyond that, Klampt's need not: the balance of the feet that stay, links
wholly below the ground, and ε in the maximum norm. Frozen legs are one mesh each, as in our own exact checks.
"""

import ctypes
import itertools
import os
import random
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from typing import Any

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply, inverse
from footfall.core.mesh import Mesh
from footfall.planning.step.problem import StepSettings
from footfall.robot.description import PARTS, link_name
from footfall.robot.kinematics import leg_link_poses
from footfall.robot.meshes.shapes import box, merged
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState

_DEFAULTS = {"perturbationRadius": 0.1, "randomizeFrequency": 50, "shortcut": 0}
"""Klampt's own where nothing is asked for; said each time, because it keeps the options of the last plan."""
_FLOATING = 6
"""Klampt's robots begin with six joints that place the base; ours stays at its origin."""


class KlamptLeg:
    """One leg of a standing rover over raised ground, as Klampt sees it. Raises ImportError without Klampt."""

    def __init__(
        self, robot: Robot, state: RobotState, leg: int, ground: Mesh, settings: StepSettings | None = None
    ) -> None:
        from klampt import WorldModel

        settings = settings or StepSettings()
        self.settings, self.leg = settings, leg
        self._world = WorldModel()
        with as_file(files("footfall.robot") / "assets" / robot.name / f"{robot.name}.urdf") as urdf, _quiet():
            self._robot = self._world.loadRobot(str(urdf))
        names = [self._robot.link(i).getName() for i in range(self._robot.numLinks())]
        own = slice(6 * leg, 6 * leg + 6)
        self.lower, self.upper = robot.lower[own], robot.upper[own]
        self._config = [0.0] * len(names)
        for joint, angle in zip(robot.joint_names, state.posture, strict=True):
            self._config[names.index(joint.removesuffix("_joint"))] = float(angle)
        self._free = [names.index(joint.removesuffix("_joint")) for joint in robot.joint_names[own]]
        self._links = {part: self._robot.link(link_name(leg, part)) for part in PARTS}
        for link in self._links.values():
            # Klampt keeps files that it has read, with the margins that another world gave them
            link.geometry().setCollisionMargin(0.0)
        self._pairs = self._all_pairs(robot, state, ground)
        # no piece of one of our edges, at most ε in each joint, is longer than this in Klampt's Euclidean norm
        self._epsilon = settings.epsilon * np.sqrt(6)
        self._ignored = self._prepare_own_planning(robot)

    def poses(self, q: Array) -> dict[str, Array]:
        """T_base_link of the leg's parts at joint angles (6,)."""
        self._place(q)
        found = {}
        for part, link in self._links.items():
            R, t = link.getTransform()
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = np.reshape(R, (3, 3)).T, t
            found[part] = T
        return found

    def free(self, q: Any) -> bool:
        """Whether every pair keeps its margin at joint angles (6,); inside the limits is not asked."""
        self._place(q)
        return not any(a.withinDistance(b, margin) for a, b, margin in self._pairs)

    def search(
        self, start: Array, goal: Array, seed: int, limit: float, **options: float
    ) -> tuple[float, list[list[float]] | None]:
        """SBL over :meth:`free`, with these options of Klampt's, or as it is without any.

        Returns processor time [s] of the search alone and its path, or None where ``limit`` [s] passed. Raises
        RuntimeError where an end is blocked.
        """
        from klampt.plan.cspace import CSpace, MotionPlan

        space = CSpace()
        space.eps = self._epsilon
        space.setBounds(list(zip(self.lower.tolist(), self.upper.tolist(), strict=True)))
        limits = list(space.bound)
        space.feasible = lambda q: (  # type: ignore[method-assign]
            all(low <= angle <= high for angle, (low, high) in zip(q, limits, strict=True)) and self.free(q)
        )
        _seed(seed)
        plan = MotionPlan(space, "sbl", **(_DEFAULTS | options))
        plan.setEndpoints(start.tolist(), goal.tolist())
        return _run(plan, limit)

    def as_it_comes(self, start: Array, goal: Array, seed: int, limit: float) -> tuple[float, list[list[float]] | None]:
        """The same by Klampt's own planning for robots: its space, its collision tests, the options it prefers.

        Its margins are of single geometries and add up in pairs, so they are our δ only where all of a kind are equal;
        elsewhere they are less. Shortening is left out.
        """
        from klampt.plan import robotplanning

        options: dict[str, Any] = robotplanning.preferred_plan_options(self._robot) | {"shortcut": 0}
        self._place(start)
        whole = list(self._config)
        for index, angle in zip(self._free, goal, strict=True):
            whole[index] = float(angle)
        _seed(seed)
        with _quiet():
            plan = robotplanning.plan_to_config(
                self._world,
                self._robot,
                whole,
                edgeCheckResolution=self._epsilon,
                ignoreCollisions=self._ignored,
                movingSubset=self._free,
                verbose=False,
                **options,
            )
        if plan is None:
            raise RuntimeError("an end of the search is blocked for Klampt")
        return _run(plan, limit)

    def _place(self, q: Any) -> None:
        for index, angle in zip(self._free, q, strict=True):
            self._config[index] = float(angle)
        self._robot.setConfig(self._config)

    def _all_pairs(self, robot: Robot, state: RobotState, ground: Mesh) -> list[tuple[Any, Any, float]]:
        """Geometries that must keep apart, and by how much [m]; in base."""
        self._place(state.leg(self.leg))
        deltas, extra = robot.description.clearances, self.settings.clearance
        shapes = {part: link.geometry() for part, link in self._links.items()}
        T_base_site = inverse(np.asarray(state.T_site_base))
        raised = ground.vertices + np.array([0.0, 0.0, self.settings.raise_terrain])
        # each twice: the margins of Klampt's own tests belong to the geometry, and must not add to ours
        in_base = Mesh(apply(T_base_site, raised), ground.triangles)
        self._world.makeTerrain("ground").geometry().set(_geometry(in_base))
        terrain = _geometry(in_base)
        pairs = [(shapes[part], terrain, delta + extra) for part, delta in deltas.terrain.items()]
        pairs += [(shapes[pair.part_a], shapes[pair.part_b], pair.distance + extra) for pair in deltas.own_leg]
        chassis = _geometry(robot.description.meshes["base"])
        pairs += [(shapes[part], chassis, delta + extra) for part, delta in deltas.chassis.items()]
        payload = robot.description.payload
        if payload is not None:
            load = box(payload.size, payload.position)
            self._world.makeRigidObject("payload").geometry().set(_geometry(load))
            load = _geometry(load)
            pairs += [(shapes[part], load, deltas.payload + extra) for part in PARTS]
        for other in robot.legs:
            if other != self.leg:
                poses = leg_link_poses(robot, state.leg(other), other)
                links = [(robot.description.meshes[link], T) for link, T in poses.items()]
                body = _geometry(merged([Mesh(apply(T, mesh.vertices), mesh.triangles) for mesh, T in links]))
                pairs += [(shapes[part], body, deltas.other_leg + extra) for part in PARTS]
        return pairs

    def _prepare_own_planning(self, robot: Robot) -> list[Any]:
        """Margins and pairs of Klampt's own collision tests; returns those that they must leave out."""
        deltas, extra = robot.description.clearances, self.settings.clearance
        checked = {frozenset((pair.part_a, pair.part_b)) for pair in deltas.own_leg}
        moving = {link.getName() for link in self._links.values()}
        links = [self._robot.link(i) for i in range(_FLOATING - 1, self._robot.numLinks())]
        parts = {link_name(self.leg, part): part for part in PARTS}
        for first, second in itertools.combinations(links, 2):
            a, b = first.getName(), second.getName()
            if a in moving and b in moving:
                kept = frozenset((parts[a], parts[b])) in checked
            elif a in moving or b in moving:
                kept = "base" not in (a, b) or parts[b if a == "base" else a] in deltas.chassis
            else:
                kept = False
            self._robot.enableSelfCollision(first.getIndex(), second.getIndex(), kept)
        for link in links:
            if link.getName() not in moving:
                chassis = link.getName() == "base"
                link.geometry().setCollisionMargin(
                    extra + (min(deltas.chassis.values()) if chassis else deltas.other_leg)
                )
        ground = self._world.terrain(0)
        ground.geometry().setCollisionMargin(min(deltas.terrain.values()) + extra)
        if self._world.numRigidObjects():
            self._world.rigidObject(0).geometry().setCollisionMargin(deltas.payload + extra)
        fixed = [link for link in links if link.getName() not in moving]
        bodies = [ground, *(self._world.rigidObject(i) for i in range(self._world.numRigidObjects()))]
        return [(link, body) for link in fixed for body in bodies]


def _geometry(mesh: Mesh) -> Any:
    from klampt import Geometry3D, TriangleMesh

    triangles = TriangleMesh()
    triangles.setVertices(np.ascontiguousarray(mesh.vertices, float))
    triangles.setIndices(np.ascontiguousarray(mesh.triangles, np.int32))  # type: ignore[arg-type]
    geometry = Geometry3D()
    geometry.setTriangleMesh(triangles)
    return geometry


@contextmanager
def _quiet() -> Iterator[None]:
    """Klampt's C++ writes to standard output, where figures and JSON are printed."""
    libc = ctypes.CDLL(None)
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        try:
            yield
        finally:
            libc.fflush(None)
            os.dup2(kept, 1)
            os.close(kept)


def _seed(seed: int) -> None:
    from klampt.plan import motionplanning

    random.seed(seed)
    motionplanning.set_random_seed(seed)


def _run(plan: Any, limit: float) -> tuple[float, list[list[float]] | None]:
    begin, path = time.process_time(), None
    while path is None and time.process_time() - begin < limit:
        plan.planMore(1)
        path = plan.getPath() or None
    seconds = time.process_time() - begin
    plan.close()
    plan.space.close()
    return seconds, path
