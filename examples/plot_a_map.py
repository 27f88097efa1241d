"""Draw layers of a leg's map as a picture: `python plot_a_map.py map.png`. Needs matplotlib."""

import sys

import matplotlib

import footfall
from footfall.terrain.generate import rock_field

LAYERS = ("slope", "margin", "footing")


def main() -> None:
    matplotlib.use("agg")
    from matplotlib import pyplot

    robot = footfall.load_robot("athlete")
    dem = rock_field(size=8.0, resolution=0.04, abundance=0.03, largest=0.4, seed=4)
    state = footfall.stand(robot, dem, x=0, y=0, yaw=0)
    maps = footfall.compute_maps(robot, dem, state, leg=2)
    figure, axes = pyplot.subplots(1, len(LAYERS), figsize=(12, 4), layout="constrained")
    for axis, name in zip(axes, LAYERS, strict=True):
        drawn = axis.imshow(maps.layers[name], origin="lower", extent=(-4, 4, -4, 4))
        axis.set_title(name)
        figure.colorbar(drawn, ax=axis)
    path = sys.argv[1] if len(sys.argv) > 1 else "map.png"
    figure.savefig(path)
    pyplot.close(figure)
    print(f"drawn to {path}")


if __name__ == "__main__":
    main()
