"""Values as files: one npz for each, the same bytes for the same value on every machine.

The file holds the flat form of :mod:`footfall.core.value`: entry ``structure.npy`` (UTF-8 JSON as
uint8) and ``array_<i>.npy``. The digest of the stored form names the value for ever, also where a later
version adds a field: a decoded value keeps the digest it was stored under.
"""

import io
import json
import math
import re
import zipfile
import zlib
from importlib import import_module
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from footfall.core.errors import InvalidBundle, InvalidInput
from footfall.core.misread import Unreadable, place_of
from footfall.core.value import Value, digest_flat, flatten, unflatten

MAX_BYTES = 1 << 30
"""Largest accepted artifact, unpacked [bytes]."""

_AT_ONCE = 1 << 20
_LONGEST_HEAD = 10 + (1 << 16)
"""Of an array in version 1.0 of its format [bytes]."""
_HEAD = re.compile(
    rb"\x93NUMPY\x01\x00(?P<length>..)\{'descr': '(?P<dtype>[<>|=]?[a-zA-Z][0-9]*)', 'fortran_order': False, "
    rb"'shape': \((?P<shape>[0-9, ]*)\), \} *\n",
    re.DOTALL,
)
"""Of an array of numbers, as numpy writes it (version 1.0 of its format)."""

_EPOCH = (1980, 1, 1, 0, 0, 0)

# Where each value lives, by the name that it is stored under, so that a file can be read before anything else
# imported its class. Values of the layers above register themselves: only they read files that hold them.
HOMES: dict[str, tuple[str, ...]] = {
    "footfall.balance.balance_settings": ("BalanceSettings",),
    "footfall.balance.tether": ("Tether",),
    "footfall.balance.torques": ("TorqueCheck",),
    "footfall.core.grid": ("GridGeometry",),
    "footfall.core.mesh": ("Mesh",),
    "footfall.core.value": ("Provenance",),
    "footfall.maps.layers": (
        "MapSettings",
        "MapStack",
    ),
    "footfall.maps.quality_settings": ("QualitySettings",),
    "footfall.maps.traversability": ("Traversability",),
    "footfall.planning.answers": (
        "Check",
        "Status",
    ),
    "footfall.planning.body.body_shift": (
        "BodyShift",
        "PredictedState",
        "ShiftRefused",
    ),
    "footfall.planning.compliance.compliance_settings": ("ComplianceSettings",),
    "footfall.planning.execution.problem": (
        "BodyExecution",
        "BodyExecutionResult",
        "Execution",
        "ExecutionResult",
    ),
    "footfall.planning.execution.execution_settings": ("ExecutionSettings",),
    "footfall.planning.legged.problem": (
        "LeggedPlan",
        "LeggedResult",
        "LeggedSettings",
        "LeggedState",
    ),
    "footfall.planning.route.feasible": ("FeasibleGround",),
    "footfall.planning.route.problem": (
        "Corridor",
        "CostGrid",
        "NoGo",
        "Route",
        "RouteResult",
        "RouteSettings",
    ),
    "footfall.planning.body.find_problem": (
        "FindShiftSettings",
        "ShiftResult",
    ),
    "footfall.planning.body.move": (
        "BodyMovePlan",
        "BodyMoveResult",
        "BodyMoveSettings",
    ),
    "footfall.planning.queue.problem": ("PlanQueue", "QueueResult", "QueuedPlan"),
    "footfall.planning.walk.problem": (
        "Blocked",
        "FootfallCosts",
        "Place",
        "Stance",
        "Tethered",
        "WalkGoal",
        "WalkPlan",
        "WalkResult",
        "WalkSettings",
    ),
    "footfall.planning.walk_execution.decision": (
        "Act",
        "WayOn",
        "WayOnSettings",
    ),
    "footfall.planning.walk_execution.problem": (
        "FootMoveExecution",
        "WalkExecution",
        "WalkExecutionResult",
    ),
    "footfall.planning.choice.policy": ("GaitPolicy",),
    "footfall.planning.choice.reward": ("RewardWeights",),
    "footfall.planning.choice.choice_settings": ("ChoiceSettings",),
    "footfall.planning.choice.state": ("StateSpace",),
    "footfall.planning.gait.problem": ("GaitFailure", "GaitPlan", "GaitResult", "GaitSettings"),
    "footfall.planning.walk.recheck.recheck_settings": ("RecheckSettings",),
    "footfall.planning.walk.smoothing": (
        "Smoothed",
        "Smoothing",
        "WalkFigures",
    ),
    "footfall.planning.step.problem": (
        "Decision",
        "Footfall",
        "NearestPlace",
        "PlanResult",
        "StepPlan",
        "StepSettings",
    ),
    "footfall.robot.meshes.collision": ("Collision",),
    "footfall.robot.description": (
        "CameraPairSpec",
        "Clearances",
        "Leg",
        "PartPair",
        "Payload",
        "RobotDescription",
    ),
    "footfall.robot.legged.finding": (
        "Finding",
        "Grade",
    ),
    "footfall.robot.legged.legged_model": (
        "DescribedRobot",
        "LegChain",
        "LeggedModel",
        "Sole",
    ),
    "footfall.robot.legged.touching": ("Touching",),
    "footfall.robot.legged.tree": (
        "RobotTree",
        "TreeJoint",
        "TreeLink",
        "TreeShape",
    ),
    "footfall.robot.limb.coupling": ("Coupling",),
    "footfall.robot.limb.limb": ("Limb",),
    "footfall.sequence.commands": (
        "AtRest",
        "Command",
        "RuleResult",
        "Sequence",
    ),
    "footfall.sequence.edit": ("Edit",),
    "footfall.sequence.feet": ("Feet",),
    "footfall.sequence.outcome": ("Difference", "Outcome"),
    "footfall.sequence.sequence_settings": ("SequenceSettings",),
    "footfall.telemetry.calibration": (
        "CameraModel",
        "PairCalibration",
    ),
    "footfall.telemetry.images": (
        "Camera",
        "ImagePair",
        "Snapshot",
    ),
    "footfall.telemetry.joint_layout": ("JointLayout",),
    "footfall.telemetry.link": (
        "AckMessage",
        "ClearStopMessage",
        "CommandMessage",
        "EpochMessage",
        "ErrorMessage",
        "HelloMessage",
        "ImageRequestMessage",
        "QueryMessage",
        "StopAckMessage",
        "StopMessage",
    ),
    "footfall.telemetry.photographs": (
        "PhotographedPair",
        "Photographs",
    ),
    "footfall.telemetry.state": (
        "RobotState",
        "TelemetryFrame",
    ),
    "footfall.terrain.fusion.align": ("Alignment",),
    "footfall.terrain.pairs.bundle_adjustment": ("Refinement",),
    "footfall.terrain.fusion.clear": ("Area",),
    "footfall.terrain.dem": (
        "Dem",
        "HeightError",
    ),
    "footfall.terrain.scan": (
        "Scan",
        "ScanSettings",
    ),
    "footfall.terrain.pairs.epipolar": ("PairAlignment",),
    "footfall.terrain.fusion.grid_depth": ("CellSamples",),
    "footfall.terrain.pair_views": (
        "PairView",
        "SnapshotViews",
    ),
    "footfall.terrain.terrain_settings": (
        "BlendSettings",
        "TerrainSettings",
    ),
    "footfall.terrain.ground.simplified": ("SimplifiedMesh",),
    "footfall.terrain.ground.views": ("CollisionView",),
    "footfall.terrain.fusion.visibility": ("DepthView",),
}
_home = {name: module for module, names in HOMES.items() for name in names}


def encode(value: Value) -> bytes:
    """The file of one value; equal values give equal bytes."""
    structure, arrays = flatten(value)
    text = json.dumps(structure, separators=(",", ":"), allow_nan=False).encode()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        _add(archive, "structure", np.frombuffer(text, np.uint8))
        for i, array in enumerate(arrays):
            _add(archive, f"array_{i}", array)
    return out.getvalue()


def _add(archive: zipfile.ZipFile, name: str, array: np.ndarray) -> None:
    body = io.BytesIO()
    np.lib.format.write_array(body, np.ascontiguousarray(array), version=(1, 0), allow_pickle=False)
    entry = zipfile.ZipInfo(f"{name}.npy", _EPOCH)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3
    archive.writestr(entry, body.getvalue(), compresslevel=4)


def decode(data: bytes, *, expect: str | None = None, name: str = "artifact") -> Value:
    """The value of one file. ``expect``: the digest it must have; ``name``: of the file, for messages.

    Raises InvalidBundle naming the file where it is damaged, too large, of an unknown kind, or not
    what its digest says.
    """
    try:
        structure, arrays = _read(data)
        stored = digest_flat(structure, arrays)
        if expect is not None and stored != expect:
            raise InvalidBundle(
                f"{name} is damaged: its content is {stored}, not {expect}", file=name, found=stored, expected=expect
            )
        _import_homes(structure)
        value = unflatten(structure, arrays)
    except InvalidBundle:
        raise
    except (InvalidInput, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError) as err:
        why = f": {err.message}" if isinstance(err, InvalidInput) else place_of(err) or ": it is damaged or cut"
        raise InvalidBundle(f"{name} can't be read{why}", file=name) from err
    except RecursionError as err:
        raise InvalidBundle(f"{name} can't be read: it is nested too deeply", file=name) from err
    if not isinstance(value, Value):
        raise InvalidBundle(f"{name} holds no value of FootFall", file=name)
    return named(value, stored)


def named(value: Value, digest: str) -> Value:
    """Let ``value`` go by the digest it was stored under; returns it."""
    object.__setattr__(value, "_digest", digest)
    return value


def _read(data: bytes) -> tuple[Any, list[np.ndarray]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = archive.infolist()
        if sum(entry.file_size for entry in entries) > MAX_BYTES:
            raise Unreadable(f"unpacked it is larger than {MAX_BYTES >> 20} MB")
        names = ["structure.npy"] + [f"array_{i}.npy" for i in range(len(entries) - 1)]
        if sorted(entry.filename for entry in entries) != sorted(names):
            raise Unreadable("it is no artifact of FootFall")
        first, *arrays = [_array(_unpacked(archive, name)) for name in names]
    return json.loads(first.tobytes().decode()), arrays


def _unpacked(archive: zipfile.ZipFile, name: str) -> NDArray[np.uint8]:
    """The content of one entry, which is never in memory twice."""
    body = np.empty(archive.getinfo(name).file_size, np.uint8)
    left = body.data
    with cast(zipfile.ZipExtFile, archive.open(name)) as file:
        while count := file.readinto(left[:_AT_ONCE]):
            left = left[count:]
    if len(left):
        raise Unreadable(f"{name} is shorter than the file says")
    body.setflags(write=False)
    return body


def _array(body: NDArray[np.uint8]) -> np.ndarray:
    # Checked against the entry's true length before numpy allocates what the header claims. numpy would build a syntax
    # tree of the header, which CPython before 3.13 refuses now and then where several threads do so (SystemError).
    head = _HEAD.match(body[:_LONGEST_HEAD].tobytes())
    if head is None or head.end() != 10 + int.from_bytes(head["length"], "little"):
        raise Unreadable("an array has an unknown format")
    try:
        dtype = np.dtype(head["dtype"].decode())
    except TypeError as err:
        raise Unreadable("an array has numbers of an unknown kind") from err
    shape = tuple(int(size) for size in head["shape"].split(b",") if size.strip())
    count = math.prod(shape)
    if dtype.hasobject or not dtype.itemsize or len(body) - head.end() != count * dtype.itemsize:
        raise Unreadable("an array does not fit its header")
    return body[head.end() :].view(dtype).reshape(shape)


def _import_homes(structure: Any) -> None:
    if isinstance(structure, list):
        for one in structure:
            _import_homes(one)
    elif isinstance(structure, dict):
        name = structure.get("value") or structure.get("enum")
        if isinstance(name, str) and name in _home:
            import_module(_home[name])
        for one in structure.values():
            _import_homes(one)
