"""The branches of a leg's inverse kinematics in words; robot/ik.py says what their numbers mean."""

from footfall.planning.step.problem import BRANCHES


def bend_text(branch: int) -> str:
    """How the leg bends on a branch."""
    over = "reaching back over the hip, " if branch >= BRANCHES // 2 else ""
    return f"{over}the knee {'down' if branch // 2 % 2 else 'up'} (branch {branch})"


def other_knee(branch: int) -> int:
    """The branch that differs in the knee alone."""
    return branch ^ 2
