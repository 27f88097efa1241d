"""What the drum of a tether would have to do along commands, row by row; no command drives one."""

from dataclasses import replace

import numpy as np

from footfall.balance.tether import Tether
from footfall.core.arrays import Array
from footfall.sequence.commands import Command, RuleResult, Sequence
from footfall.sequence.foot_moves import foot_moves

TETHER, LENGTH, SPEED = "tether", "tether-length", "tether-speed"
UNHURRIED = 1.01
"""Commands are made to take so much longer than the drum needs: where the chassis is predicted to go is not quite as
planned."""
STILL = 1e-6
"""A tether whose length changes by less is left alone [m]."""


def on_tether(sequence: Sequence, tether: Tether | None) -> Sequence:
    """The sequence as one of a rover that hangs on a tether, with the rules of its drum; None: as it is."""
    if tether is None:
        return sequence
    hung = replace(sequence, tether=tether)
    return replace(hung, rules=(*sequence.rules, *_rules(hung, tether)))


def slow_enough(commands: tuple[Command, ...], lengths: Array, tether: Tether) -> tuple[Command, ...]:
    """Commands that take as long as the drum does.

    Args:
        commands: as long as the joints take.
        lengths: (rows + 1,) of the tether before and after each [m].
        tether: whose drum pays out and hauls in.

    Returns:
        The same commands, longer where the drum is slower.
    """
    needed = UNHURRIED * np.abs(np.diff(lengths)) / tether.speed
    return tuple(
        replace(command, duration=float(seconds)) if seconds > command.duration else command
        for command, seconds in zip(commands, needed, strict=True)
    )


def _rules(sequence: Sequence, tether: Tether) -> list[RuleResult]:
    lengths = sequence.tether_lengths
    if lengths is None or not len(sequence.commands):
        return []
    rules = []
    for row, command in enumerate(sequence.commands):
        change = abs(float(lengths[row + 1] - lengths[row]))
        if change < STILL:
            continue
        spare = tether.free_length - float(lengths[row + 1])
        text = f"the tether is {lengths[row + 1]:z.3f} m long after it, {tether.free_length:g} m at most"
        rules.append(RuleResult(LENGTH, row, spare >= 0.0, spare, "m", text))
        rate = change / command.duration if command.duration > 0.0 else float("inf")
        text = (
            f"its drum goes with {rate:z.3f} m/s, at most {tether.speed:g} m/s; give it {change / tether.speed:z.2f} s"
        )
        rules.append(RuleResult(SPEED, row, rate <= tether.speed, tether.speed - rate, "m/s", text))
    ends = [(lengths[rows.first], lengths[rows.first + rows.count]) for rows in foot_moves(sequence.commands)]
    each = ", ".join(f"{after - before:z.3f}" for before, after in ends)
    text = (
        f"these commands hang on a tether, and none drives its drum: from {lengths[0]:z.3f} m it has to pay out "
        f"{each} m in its foot moves and what follows, at up to {tether.speed:g} m/s, and to pull "
        f"with up to {tether.most_force:g} N"
    )
    return [*rules, RuleResult(TETHER, -1, False, float("nan"), "", text)]
