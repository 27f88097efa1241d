"""What a worker does while it waits for its first jobs, so that no operator waits for compiled code.

Compiled code is made at the first call ever, which takes long, and loaded from its cache at the first call in a
process.
Each of these small products calls what the jobs of its kind call; what it makes is thrown away.
"""

from collections.abc import Callable


def plan() -> object:
    """A step on level ground."""
    from footfall.io.robot_files import load_robot
    from footfall.planning.body.stand import stand
    from footfall.planning.step.plan import plan_step
    from footfall.robot.kinematics import wheel_centers
    from footfall.terrain.generate import plane

    robot, ground = load_robot("athlete"), plane(size=8.0, resolution=0.1)
    state = stand(robot, ground)
    x, y, _ = wheel_centers(robot, state.posture)[0] + state.T_site_base[:3, 3]
    return plan_step(robot, ground, state, 0, (float(x) + 0.1, float(y)))


def maps() -> object:
    """One leg's maps of level ground."""
    from footfall.io.robot_files import load_robot
    from footfall.planning.body.stand import stand
    from footfall.planning.step.leg_maps import compute_maps
    from footfall.terrain.generate import plane

    robot, ground = load_robot("athlete"), plane(size=8.0, resolution=0.25)
    return compute_maps(robot, ground, stand(robot, ground), 0)


WARM_UPS: tuple[Callable[[], object], ...] = (plan, maps)
