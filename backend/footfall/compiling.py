"""Compiles the numeric kernels once, so that no operator waits for it: each is called on a small made-up scene."""

from footfall.core.progress import Progress, no_progress

STEPS = ("ground and stance", "maps with friction", "shift of the chassis", "a step", "sag", "images to terrain")


def compile_kernels(progress: Progress = no_progress) -> None:
    """Run every kind of work once; numba keeps what it compiled beside the source, or in the user's cache folder.

    The scene is made up: fractal ground, the standard robot, rendered images. Nothing of it is kept.
    """
    import footfall
    from footfall.maps.layers import MapSettings
    from footfall.planning.compliance.rover import CompliantRover
    from footfall.planning.step.problem import StepSettings
    from footfall.robot.ik import contact_point
    from footfall.sim.render import render_snapshot
    from footfall.terrain.build import build_terrain
    from footfall.terrain.generate import fractal

    def at(step: int) -> None:
        progress(step / len(STEPS), STEPS[step])

    at(0)
    robot = footfall.load_robot("athlete")
    ground = fractal(size=8.0, resolution=0.05, roughness=0.01, seed=1)
    state = footfall.stand(robot, ground)
    at(1)
    footfall.compute_maps(robot, ground, state, 0, MapSettings(friction=True), preview=lambda coarse: None)
    x, y, _ = contact_point(robot, state.posture, 0, state.T_site_base)
    at(2)
    footfall.find_shift(robot, ground, state, 0, (x + 0.1, y))
    at(3)
    footfall.plan_step(robot, ground, state, 0, (x - 0.2, y + 0.2), settings=StepSettings(planner="sbl"))
    at(4)
    CompliantRover(robot, ground).let_down(state.posture, state.T_site_base)
    at(5)
    build_terrain(robot, render_snapshot(robot, state, ground, seed=1))
    progress(1.0, "compiled")
