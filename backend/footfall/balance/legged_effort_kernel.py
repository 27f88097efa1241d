"""What the forces on standing feet do to the joints of a legged robot: compiled."""

from footfall.compiled import njit
from footfall.core.arrays import Array, Mask


@njit()
def moves_of(point: Array, axes: Array, origins: Array, slides: Mask) -> Array:
    """How a point of the last body, (3,) [m], moves with a leg's joints, (joints, 3).

    axes, origins: of the joints (joints, 3), in one frame with the point; slides: (joints,), which of them slide.
    """
    moves = axes.copy()
    for joint in range(len(axes)):
        if not slides[joint]:
            axis = axes[joint]
            x, y, z = point[0] - origins[joint, 0], point[1] - origins[joint, 1], point[2] - origins[joint, 2]
            moves[joint, 0] = axis[1] * z - axis[2] * y
            moves[joint, 1] = axis[2] * x - axis[0] * z
            moves[joint, 2] = axis[0] * y - axis[1] * x
    return moves
