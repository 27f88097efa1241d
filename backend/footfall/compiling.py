"""Compiles the numeric kernels once, so that no operator waits for it: each is called on a small made-up scene.

A process compiles one kernel at a time, so two share the work.
"""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from multiprocessing import get_context

from footfall.core.progress import Progress, no_progress
from footfall.robot.model import Robot
from footfall.telemetry.state import RobotState
from footfall.terrain.dem import Dem

PROCESSES = 2
"""More would only wait for the one that does the maps, half of the whole; each needs about a gigabyte."""
SCENE = "ground and stance"


def compile_kernels(progress: Progress = no_progress) -> None:
    """Run every kind of work once; numba keeps what it compiled beside the source, or in the user's cache folder.

    The scene is made up: fractal ground, the standard robot, rendered images. Nothing of it is kept.
    """
    progress(0.0, SCENE)
    _scene()  # first, or every process would compile what all of them need
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        begun = {pool.submit(_on_scene, what): what for what in WORK}
        for done, finished in enumerate(as_completed(begun), start=1):
            finished.result()
            progress(done / len(WORK), f"{begun[finished]}: compiled")


@cache
def _scene() -> tuple[Robot, Dem, RobotState]:
    import footfall
    from footfall.terrain.generate import fractal

    robot = footfall.load_robot("athlete")
    ground = fractal(size=8.0, resolution=0.05, roughness=0.01, seed=1)
    return robot, ground, footfall.stand(robot, ground)


def _on_scene(what: str) -> None:
    WORK[what](*_scene())


def _maps(robot: Robot, ground: Dem, state: RobotState) -> None:
    import footfall
    from footfall.maps.layers import MapSettings

    footfall.compute_maps(robot, ground, state, 0, MapSettings(friction=True), preview=lambda coarse: None)


def _images(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.sim.render import render_snapshot
    from footfall.terrain.build import build_terrain

    build_terrain(robot, render_snapshot(robot, state, ground, seed=1))


def _sag(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.planning.compliance.compliant_rover import CompliantRover

    CompliantRover(robot, ground).let_down(state.posture, state.T_site_base)


def _step(robot: Robot, ground: Dem, state: RobotState) -> None:
    import footfall
    from footfall.planning.step.problem import StepSettings
    from footfall.robot.ik import contact_point

    x, y, _ = contact_point(robot, state.posture, 0, state.T_site_base)
    footfall.find_shift(robot, ground, state, 0, (x + 0.1, y))
    footfall.plan_step(robot, ground, state, 0, (x - 0.2, y + 0.2), settings=StepSettings(planner="sbl"))


def _walk(robot: Robot, ground: Dem, state: RobotState) -> None:
    import footfall
    from footfall.planning.walk.problem import WalkSettings

    footfall.plan_walk(robot, ground, state, (0.5, 0.0), seed=0, settings=WalkSettings(time_limit=1000.0))


def _route(robot: Robot, ground: Dem, state: RobotState) -> None:
    import footfall
    from footfall.core.grid import GridGeometry
    from footfall.planning.route.field import CostField
    from footfall.planning.route.problem import COSTS, RouteSettings

    costs = CostField(GridGeometry(0.0, 0.0, 1.0, 8, 8), [[1.0] * 8, [2.0] * 8] * 4, (1.0, 1.0))
    costs.plan((5.0, 6.0))
    costs.change([[3, 3]], [float("inf")])
    costs.plan((5.0, 6.0))
    for cost in COSTS:
        footfall.plan_route(robot, ground, state, (0.5, 0.5), settings=RouteSettings(cost=cost))
    together = RouteSettings(cost="feasible", turning=0.5, together=True)
    footfall.plan_route(robot, ground, state, (0.5, 0.5), settings=together)


def _gait(robot: Robot, ground: Dem, state: RobotState) -> None:
    import footfall

    footfall.plan_gait(robot, ground, state, (0.3, 0.0), gait="tripod")


def _whole_rover(robot: Robot, ground: Dem, state: RobotState) -> None:
    import numpy as np

    from footfall.balance.balance_settings import BalanceSettings
    from footfall.balance.held import held_tables, placed_postures, postures_held
    from footfall.balance.held_kernel import held_at_once
    from footfall.planning.scene.ground import Nearby
    from footfall.planning.scene.rover_kernel import rovers_are_clear
    from footfall.planning.scene.rover_tables import rover_tables
    from footfall.planning.scene.whole_body import WholeBody

    qs, Ts_site_base = np.array([state.posture]), np.array([state.T_site_base])
    standing = np.ones((1, robot.leg_count), bool)
    normals = np.tile((0.0, 0.0, 1.0), (1, robot.leg_count, 1))
    settings = BalanceSettings()
    postures_held(robot, qs, Ts_site_base, standing, normals, settings)
    poses, Ts, contacts, unit, down = placed_postures(robot, qs, Ts_site_base, standing, normals)
    held_at_once(poses[0], Ts[0], contacts[0], unit[0], down[0], held_tables(robot, settings), 1.0)
    rovers_are_clear(qs, Ts_site_base, standing, 0.0, rover_tables(robot, ground.heights, ground.geometry))
    body = WholeBody(robot, Nearby(ground, np.zeros(ground.heights.shape, bool)))
    links = body.poses(qs)
    body.own_gap(links)
    body.ground_gap(Ts_site_base[:, None] @ links, body.links, touching=robot.legs)


def _other_robot(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.io.any_robot import load_legged
    from footfall.planning.legged.circulate import plan_circulating
    from footfall.planning.legged.stand import stand

    ambler = load_legged("ambler")
    plan_circulating(ambler, ground, stand(ambler, ground), (0.1, 0.0))


def _limb(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.robot.limb.limb import limb_of
    from footfall.robot.limb.numeric import NumericLimb

    solver = NumericLimb(limb_of(robot.model, "leg0_wheel", "pose"))
    q = state.posture[None, :6]
    solver.solve(solver.feet(q))
    solver.solve_from(solver.feet(q), q)


def _scan(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.terrain.gridding import terrain_of_scan
    from footfall.terrain.ground.triangulate import triangulate
    from footfall.terrain.scan import Scan

    terrain_of_scan(Scan(triangulate(ground).vertices, "made up", unit="m", up="z"))


def _mesh(robot: Robot, ground: Dem, state: RobotState) -> None:
    from footfall.terrain.ground.mesh_terrain import height_error
    from footfall.terrain.ground.triangulate import triangulate

    height_error(triangulate(ground), ground)


WORK: dict[str, Callable[[Robot, Dem, RobotState], None]] = {
    "shift and step": _step,
    "walk": _walk,
    "whole rover": _whole_rover,
    "route": _route,
    "gait": _gait,
    "limb": _limb,
    "another robot": _other_robot,
    "sag": _sag,
    "maps with friction": _maps,
    "images to terrain": _images,
    "mesh to terrain": _mesh,
    "scan to terrain": _scan,
}
"""In this order, what the maps share with the step is compiled before they are begun, and both processes end alike."""
