"""Descriptions of robots that nobody here wrote: the package example-robot-data, where it is installed."""

import sys
from pathlib import Path

import pytest

QUADRUPEDS = {
    "ANYmal B": "anymal_b_simple_description/robots/anymal.urdf",
    "ANYmal B with Kinova arm": "anymal_b_simple_description/robots/anymal-kinova.urdf",
    "ANYmal C": "anymal_c_simple_description/urdf/anymal.urdf",
    "Solo-12": "solo_description/robots/solo12.urdf",
    "HyQ": "hyq_description/robots/hyq_no_sensors.urdf",
    "Go2": "go2_description/urdf/go2.urdf",
    "A1": "a1_description/urdf/a1.urdf",
    "B1": "b1_description/urdf/b1.urdf",
    "Laikago": "laikago_description/urdf/laikago.urdf",
    "Centauro (wheels for feet)": "centauro_description/urdf/centauro.urdf",
}
OTHERS = {
    "Panda (arm)": "panda_description/urdf/panda.urdf",
    "UR5 (arm)": "ur_description/urdf/ur5_robot.urdf",
    "Bolt (biped)": "bolt_description/robots/bolt.urdf",
    "Hector (flies)": "hector_description/robots/quadrotor_base.urdf",
    "Allegro (hand)": "allegro_hand_description/urdf/allegro_right_hand.urdf",
}


def described(name: str) -> Path:
    """The URDF of one of those robots; skips the test where the package is not installed."""
    for folder in sys.path:
        robots = Path(folder) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
        if robots.is_dir():
            return robots / (QUADRUPEDS | OTHERS)[name]
    pytest.skip("example-robot-data is not installed (extra dev)")
