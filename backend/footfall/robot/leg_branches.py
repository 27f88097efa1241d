"""What the number of a branch of a leg's inverse kinematics says; ik.py says what shoulder, elbow and wrist are.

The number is ``4 · shoulder + 2 · elbow + wrist``, each 0 or 1. The functions take numbers and arrays of them, but for
the words; compiled code calls them too (ik_kernel.py), and what names products loads this without numba.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

BRANCHES = 8

Branch = TypeVar("Branch", int, NDArray[np.int64])


def branch_number(bend: Branch, wrist: Branch) -> Branch:
    """The branch with that shoulder and elbow, see :func:`bend_of`, and that wrist."""
    return 2 * bend + wrist


def bend_of(branch: Branch) -> Branch:
    """Shoulder and elbow, ``2 · shoulder + elbow``: what stays while the wrist turns over."""
    return branch // 2


def shoulder_of(branch: Branch) -> Branch:
    """1: the leg reaches back over its hip."""
    return branch // 4


def elbow_of(branch: Branch) -> Branch:
    """1: the knee bends down."""
    return branch // 2 % 2


def wrist_of(branch: Branch) -> Branch:
    """1: the ankle pitch is negative."""
    return branch % 2


def other_knee(branch: int) -> int:
    """The branch that differs in the knee alone."""
    return branch ^ 2


def bend_text(branch: int) -> str:
    """How the leg bends on a branch."""
    over = "reaching back over the hip, " if shoulder_of(branch) else ""
    return f"{over}the knee {'down' if elbow_of(branch) else 'up'} (branch {branch})"
