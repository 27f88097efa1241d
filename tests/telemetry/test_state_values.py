"""What a state and a telemetry frame refuse, field by field."""

import pickle

import numpy as np
import pytest

from footfall.core.errors import InvalidInput, InvalidTelemetry
from footfall.core.frames import rotation, transform
from footfall.telemetry.state import MODES, RobotState, TelemetryFrame


def state(**change):
    fields = {
        "robot": "athlete",
        "time": 1000.0,
        "posture": np.linspace(-1, 1, 36),
        "T_site_base": transform(rotation("z", 0.3), (1, 2, 3)),
        "wheel_forces": np.zeros((6, 3)),
        "joint_torques": np.zeros(36),
        "mode": "idle",
    }
    return RobotState(**(fields | change))


def spoiled(shape, number):
    out = np.zeros(shape)
    out.flat[-1] = number
    return out


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_is_accepted(mode):
    assert state(mode=mode).mode == mode


def test_legs_are_counted_from_the_posture():
    assert state().leg_count == 6
    np.testing.assert_array_equal(np.concatenate([state().leg(i) for i in range(6)]), state().posture)
    small = state(posture=np.zeros(24), wheel_forces=np.zeros((4, 3)), joint_torques=np.zeros(24))
    assert small.leg_count == 4


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("posture", np.zeros(35)),
        ("posture", np.zeros(0)),
        ("posture", np.zeros((6, 6))),
        ("posture", spoiled(36, np.nan)),
        ("posture", spoiled(36, np.inf)),
        ("posture", [0.0] * 36),
        ("posture", None),
        ("joint_torques", np.zeros(30)),
        ("joint_torques", spoiled(36, np.nan)),
        ("joint_torques", [0.0] * 36),
        ("wheel_forces", np.zeros((5, 3))),
        ("wheel_forces", np.zeros(18)),
        ("wheel_forces", spoiled((6, 3), -np.inf)),
        ("wheel_forces", None),
        ("time", np.nan),
        ("time", np.inf),
        ("mode", "walking"),
        ("mode", ""),
        ("T_site_base", np.eye(3)),
        ("T_site_base", 2 * np.eye(4)),
        ("T_site_base", spoiled((4, 4), 1.0)),
        ("T_site_base", np.full((4, 4), np.nan)),
        ("T_site_base", "here"),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_each_field_is_refused_by_name(field, wrong):
    with pytest.raises(InvalidInput, match=field):
        state(**{field: wrong})


def test_a_refusal_is_of_the_telemetry_kind():
    for wrong in ({"posture": np.zeros(5)}, {"mode": "walking"}, {"time": np.nan}, {"wheel_forces": np.zeros((1, 3))}):
        with pytest.raises(InvalidTelemetry):
            state(**wrong)


def test_a_frame_counts_from_zero_and_commands_every_joint():
    frame = TelemetryFrame(0, state(), state().posture)
    assert pickle.loads(pickle.dumps(frame)).digest == frame.digest
    with pytest.raises(InvalidTelemetry, match="number"):
        TelemetryFrame(-1, state(), state().posture)
    for wrong in (np.zeros(30), spoiled(36, np.nan), np.zeros((6, 6))):
        with pytest.raises(InvalidTelemetry, match="commanded"):
            TelemetryFrame(0, state(), wrong)


def test_equal_states_have_equal_digests_and_any_field_changes_them():
    assert state().digest == state().digest
    changes = [
        {"robot": "other"},
        {"time": 1001.0},
        {"posture": np.zeros(36)},
        {"T_site_base": np.eye(4)},
        {"wheel_forces": np.ones((6, 3))},
        {"joint_torques": np.ones(36)},
        {"mode": "moving"},
    ]
    assert len({state().digest, *(state(**one).digest for one in changes)}) == len(changes) + 1
