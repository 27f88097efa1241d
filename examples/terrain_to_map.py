"""Read a terrain from a file and count where a leg of the rover may stand."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import footfall
from footfall.maps.colors import FOOTING

GRID = "ncols 60\nnrows 60\nxllcorner -3\nyllcorner -3\ncellsize 0.1\n"


def main() -> None:
    heights = 0.02 * np.random.default_rng(1).random((60, 60))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "ground.asc"
        path.write_text(GRID + "\n".join(" ".join(f"{z:.3f}" for z in row) for row in heights) + "\n")
        dem = footfall.read_terrain(path)
    robot = footfall.load_robot("athlete")
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    maps = footfall.compute_maps(robot, dem, state, leg=2)
    found, counts = np.unique(maps.layers["footing"], return_counts=True)
    for footing, count in zip(found, counts, strict=True):
        print(f"{FOOTING[int(footing)][0]}: {count} cells")


if __name__ == "__main__":
    main()
