"""Pictures of a sequence as inline SVG: feet from above, and the moved leg from the side. Millimetres on paper."""

from dataclasses import dataclass

import numpy as np

from footfall.core.arrays import Array
from footfall.core.frames import apply
from footfall.core.polygon import convex_hull
from footfall.robot.description import link_name
from footfall.robot.kinematics import leg_link_poses, wheel_centers
from footfall.robot.model import Robot
from footfall.sequence.commands import Sequence
from footfall.sequence.moved_legs import moved_legs

WIDTH, HEIGHT, EDGE = 88.0, 72.0, 6.0
"""Of a picture, and its empty edge [mm]."""

_SAMPLES = 12
"""Postures drawn along one command."""


@dataclass(frozen=True)
class Picture:
    """Points of the site's two axes that are drawn, (n, 2) [m], and how they come to paper."""

    least: Array
    scale: float

    @classmethod
    def around(cls, points: Array) -> "Picture":
        """The picture that shows all points as large as fits."""
        least, most = points.min(axis=0), points.max(axis=0)
        room = np.array([WIDTH - 2 * EDGE, HEIGHT - 2 * EDGE])
        scale = float(np.min(room / np.maximum(most - least, 1e-3)))
        spare = room / scale - (most - least)
        return cls(least - spare / 2, scale)

    def paper(self, points: Array) -> Array:
        """Site [m] → paper [mm], y down; (…, 2)."""
        at = EDGE + (np.asarray(points, float) - self.least) * self.scale
        return np.stack([at[..., 0], HEIGHT - at[..., 1]], axis=-1)

    def line(self, points: Array, style: str, closed: bool = False) -> str:
        """A polyline or polygon through site points (n, 2)."""
        at = " ".join(f"{x:z.2f},{y:z.2f}" for x, y in self.paper(points))
        return f'<{"polygon" if closed else "polyline"} points="{at}" {style}/>'

    def circle(self, center: Array, radius: float, style: str) -> str:
        """A circle; radius in metres."""
        x, y = self.paper(center)
        return f'<circle cx="{x:z.2f}" cy="{y:z.2f}" r="{max(radius * self.scale, 0.4):z.2f}" {style}/>'

    def label(self, at: Array, text: str) -> str:
        """Text of FootFall's own (never from a file), centred on a site point."""
        x, y = self.paper(at)
        return f'<text x="{x:z.2f}" y="{y + 1.1:z.2f}" text-anchor="middle">{text}</text>'

    def scale_bar(self) -> str:
        """A bar of a round length in the lower left corner."""
        length = next((one for one in (2.0, 1.0, 0.5, 0.2, 0.1, 0.05) if one * self.scale <= 30), 0.02)
        end, y = 3 + length * self.scale, HEIGHT - 2.0
        return (
            f'<path d="M3 {y - 1} V{y} H{end:z.2f} V{y - 1}" class="thin"/>'
            f'<text x="{end + 1:z.2f}" y="{y:z.2f}">{length:g} m</text>'
        )


def wheel_paths(robot: Robot, sequence: Sequence) -> dict[int, Array]:
    """Wheel centres of each leg that steps, in order of first moving, through its own rows: leg → (n, 3) site [m]."""
    paths: dict[int, list[Array]] = {}
    before, T = sequence.start, sequence.T_site_base
    for row, leg in enumerate(moved_legs(sequence)):
        after, T_after = sequence.predicted[row], sequence.poses[row]
        if leg is not None:
            path = paths.setdefault(leg, [])
            for share in np.linspace(0.0, 1.0, _SAMPLES):
                center = wheel_centers(robot, before + share * (after - before))[leg]
                path.append((1.0 - share) * apply(T, center) + share * apply(T_after, center))
        before, T = after, T_after
    return {leg: np.array(points) for leg, points in paths.items()}


def top_view(robot: Robot, sequence: Sequence, ways: dict[int, Array]) -> str:
    """Wheels and chassis from above, x of the site to the right, y up; grey where they start, black where they end.

    ways: see :func:`wheel_paths`.
    """
    first = _seen_from_above(robot, sequence.start, sequence.T_site_base)
    last = _seen_from_above(robot, sequence.predicted[-1], sequence.poses[-1])
    paths = {leg: path[:, :2] for leg, path in ways.items()}
    radius = robot.wheel_radius
    around = [*first, *last, *paths.values()]
    corners = np.concatenate([points + offset for points in around for offset in (-radius, radius)])
    picture = Picture.around(corners)
    parts = []
    for (wheels, chassis), style in ((first, "start"), (last, "end")):
        parts.append(picture.line(chassis, f'class="{style}"', closed=True))
        parts += [picture.circle(center, radius, f'class="{style}"') for center in wheels]
    parts += [picture.line(path, f'class="path leg{leg}"') for leg, path in paths.items()]
    parts += [picture.label(center, str(leg)) for leg, center in enumerate(last[0])]
    return _svg("Wheels and chassis from above", [*parts, picture.scale_bar()])


def side_view(robot: Robot, sequence: Sequence, leg: int, path: Array) -> str:
    """One leg from the side, across the direction of the path (n, 3) of its wheel; the height is the site's."""
    along = _direction(path)
    start = _leg_line(robot, sequence.start, sequence.T_site_base, leg)
    end = _leg_line(robot, sequence.predicted[-1], sequence.poses[-1], leg)

    def seen(points: Array) -> Array:
        return np.stack([points[:, :2] @ along, points[:, 2]], axis=1)

    radius = robot.wheel_radius
    drawn = [seen(points) for points in (path, start, end)]
    picture = Picture.around(np.concatenate([points + offset for points in drawn for offset in (-radius, radius)]))
    parts = []
    for points, style in ((drawn[1], "start"), (drawn[2], "end")):
        parts.append(picture.line(points, f'class="{style}"'))
        parts.append(picture.circle(points[-1], radius, f'class="{style}"'))
    parts.append(picture.line(drawn[0], f'class="path leg{leg}"'))
    return _svg(f"Leg {leg} from the side", [*parts, picture.scale_bar()])


def heading(path: Array) -> float:
    """Which way the right is in the side view of a wheel's path (n, 3), in degrees from the site's x towards its y."""
    x, y = _direction(path)
    return float(np.degrees(np.arctan2(y, x)))


def _direction(path: Array) -> Array:
    """Horizontal unit vector to where a wheel is farthest from its start; the site's x where it only goes up."""
    off = path[:, :2] - path[0, :2]
    far = off[int(np.argmax(np.linalg.norm(off, axis=1)))]
    length = float(np.linalg.norm(far))
    return far / length if length > 1e-3 else np.array([1.0, 0.0])


def _seen_from_above(robot: Robot, posture: Array, T_site_base: Array) -> tuple[Array, Array]:
    """Wheel centres (legs, 2) and the outline of the hips (k, 2)."""
    hips = np.array([leg.T_base_hip[:3, 3] for leg in robot.description.legs])
    return apply(T_site_base, wheel_centers(robot, posture))[:, :2], convex_hull(apply(T_site_base, hips)[:, :2])


def _leg_line(robot: Robot, posture: Array, T_site_base: Array, leg: int) -> Array:
    """Hip, knee, ankle and wheel centre of a leg, (n, 3) site [m]."""
    links = leg_link_poses(robot, posture[6 * leg : 6 * leg + 6], leg)
    parts = ("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch", "wheel")
    return apply(T_site_base, np.array([links[link_name(leg, part)][:3, 3] for part in parts]))


def _svg(title: str, parts: list[str]) -> str:
    size = f'width="{WIDTH:g}mm" height="{HEIGHT:g}mm" viewBox="0 0 {WIDTH:g} {HEIGHT:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size}><title>{title}</title>{"".join(parts)}</svg>'
