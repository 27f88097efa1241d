"""Write one sequence in every format, and read back what can be read back."""

from pathlib import Path
from tempfile import TemporaryDirectory

import footfall
from footfall.io.exports import FORMATS, SUFFIXES
from footfall.terrain.generate import plane


def main() -> None:
    robot = footfall.load_robot("athlete")
    dem = plane(size=8.0, resolution=0.05)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    result = footfall.plan_step(robot, dem, state, leg=2, target=(-1.0, 1.7), seed=1)
    if result.plan is None:
        raise SystemExit(result.reason)
    sequence = footfall.make_sequence(result.plan)
    with TemporaryDirectory() as folder:
        for format in FORMATS:
            path = Path(folder) / f"step{SUFFIXES[format]}"
            footfall.export(sequence, format, path)
            print(f"{format}: {path.stat().st_size} bytes")
        again = footfall.read_sequence(Path(folder) / f"step{SUFFIXES['json']}", robot, dem)
    print(f"read back: {len(again.commands)} commands, the same: {again.commands[0].name == sequence.commands[0].name}")


if __name__ == "__main__":
    main()
