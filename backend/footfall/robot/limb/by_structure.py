"""Which solver a limb gets: a closed form where its structure has one, descent where not."""

from dataclasses import replace

import numpy as np

from footfall.robot.limb.coupling import Coupling
from footfall.robot.limb.cylindrical import CylindricalLimb, is_cylindrical
from footfall.robot.limb.limb import Limb
from footfall.robot.limb.limb_solver import LimbSolver
from footfall.robot.limb.numeric import NumericLimb

ENDLESS = 100.0
"""Turns to each side that a joint without limits may come to, where its turns are counted: some end has to be."""


def solver_of(limb: Limb, endless: bool = False, coupling: Coupling | None = None) -> LimbSolver:
    """endless: the first joint turns without limits. A closed form counts its turns on; descent stays within one.

    coupling: which joints follow others; None: all move by themselves.
    """
    if not is_cylindrical(limb) or (coupling is not None and coupling.couples):
        return NumericLimb(limb, coupling)
    if not endless:
        return CylindricalLimb(limb)
    most = np.array([2 * np.pi * ENDLESS])
    lower, upper = (np.concatenate([end, rest[1:]]) for end, rest in ((-most, limb.lower), (most, limb.upper)))
    return CylindricalLimb(replace(limb, lower=lower, upper=upper))
