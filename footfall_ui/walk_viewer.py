"""A walk of a robot that others described, looked at: robot, ground and numbered footfalls on one scrubber.

Nothing here moves a robot.
"""

import threading

import numpy as np
import viser

from footfall.core.errors import InvalidInput
from footfall.core.frames import apply
from footfall.planning.between_rows import at
from footfall.planning.legged.footfalls import footfalls
from footfall.planning.legged.problem import LeggedPlan, LeggedResult
from footfall.robot.legged.legged_robot import LeggedRobot
from footfall.robot.legged.posture import placed
from footfall.terrain.dem import Dem
from footfall_ui.scene.any_robot import leg_parts, reach
from footfall_ui.scene.crescents import CrescentDrawing
from footfall_ui.scene.legged_robot import LeggedDrawing
from footfall_ui.scene.terrain import TerrainDrawing
from footfall_ui.scene.walk import ARM, WalkDrawing, legged_marks

FRAME = 0.05
"""Between two pictures while it plays [s]."""
MOVE_LASTS = 2.0
"""So long a foot move plays, in the mean [s]."""
VIEW = (-1.5, -1.5, 1.0)
"""Of the first view from the base, in lengths of the longest leg."""
STEPS = 1000
"""Of the scrubber."""


class WalkViewer:
    """Draws a walk, or as far as one came that was not found, on a viser server until :meth:`close`."""

    def __init__(self, server: viser.ViserServer, robot: LeggedRobot, dem: Dem, result: LeggedResult) -> None:
        """result: planned with this robot on this ground. Raises InvalidInput where there is no motion to look at."""
        plan = _motion_of(result)
        self._robot, self._plan = robot, plan
        self._motion = plan.motion
        along = self._motion.travelled
        self._moments = along / along[-1] if along[-1] else np.zeros(len(along))
        self._footfalls = footfalls(robot, plan)
        self._lock = threading.Lock()
        self._drawn, self._ended, self._playing = LeggedDrawing(server, robot), threading.Event(), threading.Event()
        self._crescents = CrescentDrawing(server, robot)
        _prepare(server, plan, robot.length)
        TerrainDrawing(server).show(dem, None, None)
        WalkDrawing(server).draw(legged_marks(robot, plan), plan.Ts_site_base, end_text(result), ARM * reach(robot))
        gui = server.gui
        gui.set_panel_label(f"Walk of {robot.name}")
        gui.add_markdown(f"**{heading(result)}**\n\nNothing here moves a robot.")
        self._scrubber = gui.add_slider("Walk", 0, STEPS, 1, 0, hint="From its beginning to its end")
        self._now = gui.add_markdown("")
        self._play = gui.add_button("Play", hint="Space")
        back, on = gui.add_button("Previous foot move", hint="←"), gui.add_button("Next foot move", hint="→")
        with gui.add_folder("Checks"):
            gui.add_markdown(checks_text(result))
        self._scrubber.on_update(lambda _: self.draw())
        for button, act in ((self._play, self.play), (back, self.previous), (on, self.next)):
            button.on_click(lambda _, act=act: act())
        gui.add_command("Play or hold", hotkey="space").on_trigger(lambda _: self.play())
        gui.add_command("Previous foot move", hotkey="arrowleft").on_trigger(lambda _: self.previous())
        gui.add_command("Next foot move", hotkey="arrowright").on_trigger(lambda _: self.next())
        self.draw()
        self._thread = threading.Thread(target=self._run, name="walk-viewer", daemon=True)
        self._thread.start()

    @property
    def moment(self) -> float:
        """What is shown: 0…1 along the walk."""
        return self._scrubber.value / STEPS

    def draw(self) -> None:
        """Show the robot at the moment of the scrubber, and what it does there."""
        with self._lock:
            moment = self.moment
            posture, T_site_base = at(self._motion, moment)
            self._drawn.place(posture, T_site_base)
            row = self._row(moment)
            lifted = int(self._plan.legs[row])
            self._drawn.highlight(set() if lifted < 0 else leg_parts(self._robot, lifted))
            standing = tuple(leg for leg in self._robot.legs if leg != lifted)
            self._crescents.show(apply(T_site_base, placed(self._robot, posture).soles), standing)
            self._now.content = self.in_words(row)

    def in_words(self, row: int) -> str:
        """What the robot does on its way to a waypoint."""
        number = 1 + sum(one.row < row for one in self._footfalls)
        whole, leg = len(self._footfalls), int(self._plan.legs[row])
        if leg < 0:
            return f"before foot move {number} of {whole}: the base moves" if number <= whole else "the base moves"
        return f"foot move {number} of {whole}: leg {self._robot.leg_names[leg]}, {self._plan.phases[row]}"

    def next(self) -> None:
        """Go on to where the next foot stands."""
        self._go(min((m for m in self._ends() if m > self._scrubber.value), default=STEPS))

    def previous(self) -> None:
        """Go back to where the foot before stood, or to the beginning."""
        self._go(max((m for m in self._ends() if m < self._scrubber.value), default=0))

    def play(self) -> None:
        """Play from here, from the beginning where it is at its end; while it plays, hold."""
        if self._playing.is_set():
            self._playing.clear()
        else:
            if self._scrubber.value >= STEPS:
                self._go(0)
            self._playing.set()
        self._play.label = "Hold" if self._playing.is_set() else "Play"

    def close(self) -> None:
        """Draw nothing more."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        each = max(1, round(STEPS * FRAME / (MOVE_LASTS * max(len(self._footfalls), 1))))
        while not self._ended.wait(FRAME):
            if not self._playing.is_set():
                continue
            self._go(min(self._scrubber.value + each, STEPS))
            if self._scrubber.value >= STEPS:
                self._playing.clear()
                self._play.label = "Play"

    def _go(self, step: int) -> None:
        self._scrubber.value = step  # which draws

    def _ends(self) -> list[int]:
        """Where the scrubber is when each foot stands, or a step before: it still tells of that foot move there."""
        return [int(STEPS * self._moments[one.row]) for one in self._footfalls]

    def _row(self, moment: float) -> int:
        """The waypoint that the robot is on its way to."""
        return min(int(np.searchsorted(self._moments, moment)), len(self._moments) - 1)


def _motion_of(result: LeggedResult) -> LeggedPlan:
    plan = result.plan or result.partial
    if plan is None or len(plan.waypoints) < 2:
        raise InvalidInput(f"there is no motion to look at: {result.reason or 'the robot stays where it is'}")
    return plan


def heading(result: LeggedResult) -> str:
    """What came of the walk."""
    plan = result.plan or result.partial
    moves = 0 if plan is None else len(plan.moves)
    way = "" if plan is None else f"{moves} foot moves, the base goes {plan.chassis_way:z.2f} m"
    return f"● {way}" if result.plan is not None else f"✕ {result.reason}; it comes this far: {way}"


def end_text(result: LeggedResult) -> str:
    """What is said where the base ends."""
    return "end of the walk" if result.plan is not None else "✕ it comes this far"


def checks_text(result: LeggedResult) -> str:
    """The least margin of each check over the walk, and what was not checked."""
    rows = [
        f"| {'●' if one.holds else '✕'} {one.name} | {_margin(one.margin, one.unit)} | {one.where} |"
        for one in result.checks
    ]
    table = ["| check | least margin | where |", "| --- | --- | --- |", *rows]
    return "\n".join([*table, "", *(f"▲ not checked: {text}  " for text in result.unchecked)])


def _margin(margin: float, unit: str) -> str:
    return "–" if margin != margin else f"{margin:z.3g} {unit}".strip()


def _prepare(server: viser.ViserServer, plan: LeggedPlan, length: float) -> None:
    server.scene.set_up_direction("+z")
    server.scene.world_axes.visible = False
    server.scene.configure_default_lights(enabled=True, cast_shadow=False)
    server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
    base = plan.Ts_site_base[0, :3, 3]
    server.initial_camera.position = base + length * np.array(VIEW)
    server.initial_camera.look_at = base
