"""A robot's files judged: a URDF, or a robot.toml with the URDF that it names."""

from collections.abc import Sequence
from pathlib import Path

from footfall.core.errors import InvalidInput, InvalidRobot
from footfall.io.urdf.proposed import read_proposed
from footfall.io.urdf.read import read_urdf
from footfall.robot.legged.find_legs import legged_model
from footfall.robot.legged.finding import Finding, unusable
from footfall.robot.legged.judge_cameras import judge_cameras
from footfall.robot.legged.judge_legs import judge_legs, judge_mass, judge_posture
from footfall.robot.legged.judge_tree import judge_tree
from footfall.robot.legged.legged_model import held_joints


def examine(path: str | Path, folders: Sequence[str | Path] = ()) -> tuple[Finding, ...]:
    """Everything that is good, doubtful or unusable in a robot's description; folders: that hold packages of meshes.

    What can't be read is a finding too. Raises NotFound where there is no such file, InvalidInput for folders beside a
    robot.toml, which names its own.
    """
    path = Path(path)
    described = path.suffix.lower() == ".toml"
    if described and folders:
        raise InvalidInput(f"{path.name} names its folders itself: write them into its packages, not after --packages")
    try:
        return _of_proposed(path) if described else _of_urdf(path, folders)
    except InvalidRobot as err:
        return (unusable("reading", path.name, err.message),)


def _of_proposed(path: Path) -> tuple[Finding, ...]:
    proposed = read_proposed(path)
    model, tree = proposed.model, proposed.model.tree
    found = (*judge_tree(tree), judge_mass(tree, proposed.mass_check), *judge_legs(model))
    found += judge_cameras(tree, proposed.cameras, held_joints(model, proposed.postures))
    return (*found, *(judge_posture(model, name, posture) for name, posture in proposed.postures.items()))


def _of_urdf(path: Path, folders: Sequence[str | Path]) -> tuple[Finding, ...]:
    tree = read_urdf(path, folders)
    found = judge_tree(tree)
    try:
        return (*found, *judge_legs(legged_model(tree)))
    except InvalidRobot as err:
        return (*found, unusable("legs", tree.root, err.message))
