"""Recordings of what a rover says, as MCAP that Foxglove and ROS 2 tools open; docs/recordings.md tells the topics.

===============================  =============================  ========================================================
topic                            message                        what
===============================  =============================  ========================================================
/footfall/measured               sensor_msgs/JointState         posture as position, joint torques as effort
/footfall/commanded              sensor_msgs/JointState         what the joints are driven to, as position
/footfall/leg0/wheel_force       geometry_msgs/WrenchStamped    force of the ground on that wheel, in ``site``
/footfall/mode                   std_msgs/String                mode
/tf                              tf2_msgs/TFMessage             site → base, for those who draw; cameras with images
/tf_static                       tf2_msgs/TFMessage             base → optical frame of each camera, with images
/footfall/frame                  footfall_msgs/Frame            what these can't say: number, robot, time, T_site_base
/footfall/nav0/left              sensor_msgs/CompressedImage    a PNG of that pair, when images were taken
/footfall/nav0/left/camera_info  sensor_msgs/CameraInfo         its camera, rectified
/footfall/images                 std_msgs/String of JSON        header of those images, as on the rover link
/footfall/to_rover               std_msgs/String of JSON        messages of the rover link that went down
/footfall/acknowledgements       std_msgs/String of JSON        what became of commands and stops
/footfall/dropped                std_msgs/String of JSON        what the recorder itself could not take
===============================  =============================  ========================================================

A frame is the messages of one ``sequence`` number; ``/footfall/frame`` closes it. All its numbers are float64 in CDR,
so it reads back bit for bit: ``/tf`` alone rounds and is not read. A chunk holds whole frames. All is CDR, as ROS 2
opens no file of several encodings; recordings of version 0.1.0 have their JSON as it is, and are read too.
"""

import json

from footfall.core.json_object import JsonObject
from footfall.io.cdr import CdrReader
from footfall.io.ros2_messages import DEFINITIONS

MEASURED, COMMANDED, MODE = "/footfall/measured", "/footfall/commanded", "/footfall/mode"
FRAME, TF, TF_STATIC = "/footfall/frame", "/tf", "/tf_static"
IMAGES, TO_ROVER, ACKNOWLEDGEMENTS, DROPPED = (
    "/footfall/images",
    "/footfall/to_rover",
    "/footfall/acknowledgements",
    "/footfall/dropped",
)
FRAME_MESSAGE = "footfall_msgs/msg/Frame"
MESSAGES = {**DEFINITIONS, FRAME_MESSAGE: "uint64 number\nstring robot\nfloat64 time\nfloat64[16] t_site_base\n"}
"""Message name → its definition."""

CAMERA_INFO = "camera_info"
"""How the topic of a camera ends, below that of its images."""

SUFFIX = ".mcap"
UNFINISHED = ".mcap.part"
"""How the name of a recording ends that is being written, or was cut short."""


def object_of(encoding: str, data: bytes) -> JsonObject:
    """The JSON object of a message in an encoding of MCAP."""
    return json.loads(data if encoding == "json" else CdrReader(data).string())


def wheel_force_topic(leg: int) -> str:
    """Topic of the force on one wheel."""
    return f"/footfall/leg{leg}/wheel_force"
