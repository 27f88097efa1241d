"""What may be chosen: one iteration of a gait, or of the walk planner.

To choose another than the current one is to change: the foot moves with which its feet settle belong to its first
iteration, with the time that they take.
"""

from collections.abc import Mapping

from footfall.planning.gait.problem import GAITS, RIPPLE, TRIPOD, WAVE

WALK = "walk"
ACTIONS = (WAVE, RIPPLE, TRIPOD, WALK)
"""In the order in which tables have them. Where two are worth the same, the earlier is chosen."""
ACTION_TEXTS: Mapping[str, str] = {**GAITS, WALK: "footfalls and chassis poses are searched"}
"""In words."""
