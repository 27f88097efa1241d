"""``python -m footfall.sim --url ws://… --terrain FILE``: one simulated rover, in this process."""

import argparse
import logging
import sys
from pathlib import Path
from typing import TypeVar

from footfall.core.collector import leave_out_what_is_loaded, none_while_loading

with none_while_loading():
    from footfall.balance.balance_settings import GRAVITY
    from footfall.core.errors import FootFallError, InvalidInput
    from footfall.core.value import Value
    from footfall.io.artifacts import decode
    from footfall.robot.legged.legged_model import DescribedRobot
    from footfall.robot.legged.legged_robot import LeggedRobot
    from footfall.sim.physics.physics_settings import PhysicsSettings
    from footfall.sim.process import Start, run_rover
    from footfall.telemetry.state import RobotState


_V = TypeVar("_V", bound=Value)


def main() -> int:
    """Exit code 0 when it was asked to end, 2 where it can't start."""
    parser = argparse.ArgumentParser(prog="python -m footfall.sim", description="Simulated rover on the rover link.")
    parser.add_argument("--url", required=True, help="ws://127.0.0.1:PORT/api/v1/rover")
    parser.add_argument("--terrain", required=True, type=Path, help="terrain file that is its world")
    parser.add_argument("--robot", default="athlete", help="name or description of the robot")
    parser.add_argument("--described", type=Path, help="stored DescribedRobot (.npz) instead of --robot")
    parser.add_argument("--seed", type=int, default=0, help="of what is random: the cameras' noise")
    parser.add_argument("--x", type=float, default=0.0, help="where it stands, site frame [m]")
    parser.add_argument("--y", type=float, default=0.0, help="where it stands, site frame [m]")
    parser.add_argument("--yaw", type=float, default=0.0, help="[rad]")
    parser.add_argument("--posture", default="stand", help="named posture")
    parser.add_argument("--state", type=Path, help="stored RobotState (.npz) instead of x, y, yaw and posture")
    parser.add_argument("--physics", action="store_true", help="a rover with masses and springs, not a kinematic one")
    parser.add_argument("--gravity", type=float, default=GRAVITY, help="of that rover's world [m/s²]")
    parser.add_argument("--certificate", type=Path, help="PEM file of the server's own certificate")
    parser.add_argument("--with-parent", action="store_true", help="end when the starting process is gone")
    options = parser.parse_args()
    leave_out_what_is_loaded()
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    try:
        start = Start(options.x, options.y, options.yaw, options.posture)
        run_rover(
            options.url,
            options.terrain,
            _described(options.described) if options.described else options.robot,
            options.seed,
            start=_stored(options.state, RobotState) if options.state else start,
            physics=PhysicsSettings(gravity=options.gravity, seed=options.seed) if options.physics else None,
            with_parent=options.with_parent,
            certificate=options.certificate,
        )
    except FootFallError as err:
        sys.stderr.write(f"footfall.sim: {err.message}\n")
        return 2
    return 0


def _described(path: Path) -> LeggedRobot:
    return LeggedRobot.of(_stored(path, DescribedRobot))


def _stored(path: Path, kind: type[_V]) -> _V:
    try:
        found = decode(path.read_bytes())
    except OSError as err:
        raise InvalidInput(f"{path.name} can't be read: {err}") from err
    if not isinstance(found, kind):
        raise InvalidInput(f"{path.name} holds a {type(found).__name__}, not a {kind.__name__}")
    return found


if __name__ == "__main__":
    sys.exit(main())
