"""Commands of a rover that sags, from how it stood at rest: what they lead to, and every rule's result."""

from collections.abc import Mapping

import numpy as np

from footfall.core.value import Provenance
from footfall.robot.model import Robot
from footfall.sequence.commands import AtRest, Command, Sequence
from footfall.sequence.predict import predict
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from footfall.sequence.yielding import follow
from footfall.terrain.dem import Dem


def sequence_at_rest(
    robot: Robot,
    at_rest: AtRest,
    commands: tuple[Command, ...],
    dem: Dem | None,
    settings: SequenceSettings,
    parents: Mapping[str, str],
) -> Sequence:
    """The commands with where they lead a rover that stands as ``at_rest`` says.

    Args:
        robot: whose commands they are.
        at_rest: how it stands before the first.
        commands: set points, in order.
        dem: the ground, in site; None: nothing tells how far the rover sags, and set points stand for its postures.
        settings: with what the rules are checked.
        parents: digests of what it was made of, by their names.

    Returns:
        The sequence, predicted as the rover gives way.

    Raises:
        InvalidInput: the rest is of another robot, or fewer than three of its wheels are pressed down.
    """
    start, T_site_base = at_rest.state.posture, at_rest.state.T_site_base
    way = None if dem is None else follow(robot, at_rest, commands, dem, settings)
    commanded = predict(at_rest.set_points, commands) if way is None else way.commanded
    set_points = np.vstack([at_rest.set_points, commanded.reshape(-1, len(start))])
    return Sequence(
        robot=robot.name,
        commands=commands,
        start=start,
        predicted=set_points[1:] if way is None else way.postures,
        T_site_base=T_site_base,
        rules=check_rules(robot, commands, start, T_site_base, dem, settings, set_points, way),
        provenance=Provenance(parents, settings),
        Ts_site_base=None if way is None else way.Ts_site_base,
        at_rest=at_rest,
        commanded=set_points[1:],
    )
