"""The ROS 2 messages that FootFall writes into MCAP files: their definitions, and their CDR.

Each definition holds all that it refers to, so that Foxglove and mcap-ros2-support ask for no package.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from footfall.core.frames import quat_wxyz
from footfall.io.cdr import CdrWriter
from footfall.telemetry.images import Camera

NS = 1_000_000_000
LONGEST = 2**31 - 1
"""Seconds that builtin_interfaces/Time and Duration can say."""

TRAJECTORY, FLOAT, TEXT = "trajectory_msgs/msg/JointTrajectory", "std_msgs/msg/Float64", "std_msgs/msg/String"
JOINT_STATE, TRANSFORMS = "sensor_msgs/msg/JointState", "tf2_msgs/msg/TFMessage"
WRENCH, IMAGE = "geometry_msgs/msg/WrenchStamped", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

_PARTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
    "trajectory_msgs/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start\n"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    ),
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
}


def _definition(own: str, *parts: str) -> str:
    return own + "".join(f"{'=' * 80}\nMSG: {part}\n{_PARTS[part]}" for part in parts)


_HEADER = ("std_msgs/Header", "builtin_interfaces/Time")

DEFINITIONS = {
    TRAJECTORY: _definition(
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
        *_HEADER,
        "trajectory_msgs/JointTrajectoryPoint",
        "builtin_interfaces/Duration",
    ),
    FLOAT: "float64 data\n",
    TEXT: "string data\n",
    JOINT_STATE: _definition(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n", *_HEADER
    ),
    TRANSFORMS: _definition(
        "geometry_msgs/TransformStamped[] transforms\n",
        "geometry_msgs/TransformStamped",
        *_HEADER,
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3",
        "geometry_msgs/Quaternion",
    ),
    WRENCH: _definition(
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
        *_HEADER,
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3",
    ),
    IMAGE: _definition("std_msgs/Header header\nstring format\nuint8[] data\n", *_HEADER),
    CAMERA_INFO: _definition(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
        "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
        *_HEADER,
        "sensor_msgs/RegionOfInterest",
    ),
}
"""Message name → its definition with all that it refers to."""


def trajectory(duration: float, names: tuple[str, ...], joints: NDArray[np.float64]) -> bytes:
    """JointTrajectory with one point, reached after ``duration`` [s]; stamp 0 means now."""
    ns = round(duration * NS)
    out = CdrWriter()
    _header(out, 0, 0, "")
    _names(out, names)
    out.pack("I", 1)
    out.floats(joints)
    out.pack("I", 0, 0, 0)  # no velocities, accelerations, efforts
    out.pack("i", ns // NS)
    out.pack("I", ns % NS)
    return out.message()


def number(data: float) -> bytes:
    """Float64."""
    out = CdrWriter()
    out.pack("d", data)
    return out.message()


def text(data: str) -> bytes:
    """String."""
    out = CdrWriter()
    out.string(data)
    return out.message()


def joint_state(
    time: float, names: tuple[str, ...], position: NDArray[np.float64], effort: NDArray[np.float64] | None = None
) -> bytes:
    """JointState at ``time`` [s]; no velocities."""
    out = CdrWriter()
    _header(out, *stamp(time), "")
    _names(out, names)
    out.floats(position)
    out.pack("I", 0)
    out.floats(np.zeros(0) if effort is None else effort)
    return out.message()


def transforms(time: float, parent: str, children: Mapping[str, NDArray[np.float64]]) -> bytes:
    """TFMessage of the poses of frames in ``parent``, by name; a rotation becomes a unit quaternion, which rounds."""
    out = CdrWriter()
    out.pack("I", len(children))
    for child, T_parent_child in children.items():
        _header(out, *stamp(time), parent)
        out.string(child)
        out.fixed_floats(T_parent_child[:3, 3])
        w, x, y, z = quat_wxyz(T_parent_child[:3, :3])
        out.fixed_floats(np.array([x, y, z, w]))
    return out.message()


def wrench(time: float, frame: str, force: NDArray[np.float64]) -> bytes:
    """WrenchStamped of a force, (3,) [N], without torque."""
    out = CdrWriter()
    _header(out, *stamp(time), frame)
    out.fixed_floats(force)
    out.fixed_floats(np.zeros(3))
    return out.message()


def compressed_image(time: float, frame: str, png: bytes) -> bytes:
    """CompressedImage of a PNG file."""
    out = CdrWriter()
    _header(out, *stamp(time), frame)
    out.string("png")
    out.octets(png)
    return out.message()


def camera_info(time: float, frame: str, camera: Camera, baseline: float = 0.0) -> bytes:
    """CameraInfo of a rectified camera: no distortion is left, R is the identity.

    frame: the optical frame of the left camera of the pair, also for the right one (REP 104, image_geometry).

    baseline: how far the camera lies along +x of the left one of its pair [m]; ROS has it in P as −fx × baseline.
    """
    out = CdrWriter()
    _header(out, *stamp(time), frame)
    out.pack("I", camera.height, camera.width)
    out.string("plumb_bob")
    out.floats(np.zeros(5))
    K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    out.fixed_floats(K)
    out.fixed_floats(np.eye(3))
    out.fixed_floats(np.column_stack([K, [-camera.fx * baseline, 0.0, 0.0]]))
    out.pack("I", 0, 0)  # no binning
    out.pack("I", 0, 0, 0, 0)  # the region of interest is the whole image
    out.pack("?", False)
    return out.message()


def stamp(time: float) -> tuple[int, int]:
    """Seconds and nanoseconds of a time [s], as near as builtin_interfaces/Time can say it."""
    time = min(max(time, -LONGEST), LONGEST)
    sec = math.floor(time)
    ns = round((time - sec) * NS)
    return (sec + 1, 0) if ns == NS and sec < LONGEST else (sec, min(ns, NS - 1))


def _header(out: CdrWriter, sec: int, nanosec: int, frame: str) -> None:
    out.pack("i", sec)
    out.pack("I", nanosec)
    out.string(frame)


def _names(out: CdrWriter, names: tuple[str, ...]) -> None:
    out.pack("I", len(names))
    for name in names:
        out.string(name)
