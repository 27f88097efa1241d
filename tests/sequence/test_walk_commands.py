"""Commands of a walk: those of its parts one after the other, every rule held on every row, in every format."""

from dataclasses import replace

import numpy as np
import pytest

from footfall.core.errors import InvalidSequence
from footfall.io.exports import FORMATS, export
from footfall.io.imports import from_csv, from_fprime, from_json, from_seqjson, from_yamcs, sequence_of
from footfall.io.scripting import make_sequence as make_for_scripts
from footfall.planning.body.stand import stand
from footfall.planning.walk.parts import parts_of
from footfall.robot.description import with_payload
from footfall.robot.model import Robot
from footfall.sequence.edit import Edit, apply_edit
from footfall.sequence.make import make_sequence
from footfall.sequence.rules import check_rules
from footfall.sequence.sequence_settings import SequenceSettings
from tests.support.chassis_ground import wavy
from tests.support.sequences import require_same_commands
from tests.support.short_walks import LEG, SETTINGS, short_walk

READ = {
    "json": from_json.decode,
    "csv": from_csv.decode,
    "seqjson": from_seqjson.decode,
    "fprime": from_fprime.decode,
    "yamcs": from_yamcs.decode,
}


@pytest.fixture(scope="module")
def dem():
    return wavy(half=4.0)


@pytest.fixture(scope="module")
def walk(athlete, dem):
    return short_walk(athlete, dem, stand(athlete, dem))


@pytest.fixture(scope="module")
def commanded(athlete, dem, walk):
    return make_sequence(walk, athlete, dem)


def test_a_walk_is_commanded_part_by_part_and_every_rule_holds(athlete, dem, walk, commanded):
    assert commanded.valid, [(rule.rule, rule.row, rule.text) for rule in commanded.failures]
    asked = {rule.rule for rule in commanded.rules}
    assert {"no-drag", "balance", "torque", "terrain-collision", "self-collision", "ends-on-ground"} <= asked
    each = tuple(command for part in parts_of(walk) for command in make_sequence(part, athlete, dem).commands)
    require_same_commands(commanded.commands, each)
    assert [command.name for command in commanded.commands] == [
        *(["POSTURE_MOVE"] * 9),
        *(["LEG_MOVE"] * 17),
        *(["POSTURE_MOVE"] * 8),
    ]
    assert {command.leg for command in commanded.commands} == {None, LEG}


def test_the_rover_is_predicted_to_walk_as_planned(athlete, dem, walk, commanded):
    """Its feet carry the chassis: the poses come out of the commands, not out of the plan."""
    np.testing.assert_array_equal(commanded.start, walk.waypoints[0])
    np.testing.assert_array_equal(commanded.T_site_base, walk.Ts_site_base[0])
    np.testing.assert_allclose(commanded.predicted, walk.waypoints[1:], atol=1e-12)
    np.testing.assert_allclose(commanded.poses, walk.Ts_site_base[1:], atol=1e-9)
    unseen = make_sequence(walk, athlete)
    require_same_commands(unseen.commands, commanded.commands)
    np.testing.assert_allclose(unseen.poses, commanded.poses, atol=1e-12)


def test_the_rules_ask_what_the_walk_was_planned_with(athlete, dem, walk, commanded):
    asked = commanded.provenance.settings
    assert (asked.conservative, asked.least_margin, asked.clearance) == (False, SETTINGS.least_margin, 0.0)
    assert commanded.provenance.parents == {"plan": walk.digest, "robot": athlete.digest, "dem": dem.digest}
    required = replace(SETTINGS, support="required", clearance=0.01)
    wary = replace(walk, provenance=replace(walk.provenance, settings=required))
    asked = make_sequence(wary, athlete).provenance.settings
    assert isinstance(asked, SequenceSettings)
    assert (asked.conservative, asked.clearance) == (True, 0.01)


def test_the_rules_weigh_the_payload_of_the_walk_also_after_an_edit(athlete, dem, walk, commanded):
    """As if the description carried it; the box that must stay clear is another matter."""
    place = np.array([0.3, 0.6, 0.3])
    described = Robot(with_payload(athlete.description, 120.0, position=place))
    own = replace(walk.provenance, settings=replace(SETTINGS, payload_mass=120.0, payload_position=place))
    laden = make_sequence(replace(walk, provenance=own), athlete, dem)
    parents = {**walk.provenance.parents, "robot": described.digest}
    same = make_sequence(replace(walk, provenance=replace(walk.provenance, parents=parents)), described, dem)
    longer = apply_edit(athlete, laden, Edit("duration", 0, number=60.0), dem)

    def weighed(sequence):
        return np.array([one.margin for one in sequence.rules if one.rule in ("balance", "torque")])

    np.testing.assert_allclose(weighed(laden), weighed(same), atol=1e-6)
    np.testing.assert_array_equal(weighed(longer), weighed(laden))
    assert np.abs(weighed(laden) - weighed(commanded)).max() > 0.05


def test_a_row_that_does_not_fit_the_one_before_breaks_a_rule(athlete, dem, walk, commanded):
    """Without the moves of the chassis before it, the step is made over another stance."""
    rows = [row for row, command in enumerate(commanded.commands) if command.leg is None and row < 9]
    left_out = tuple(command for row, command in enumerate(commanded.commands) if row not in rows)
    rules = check_rules(athlete, left_out, commanded.start, commanded.T_site_base, dem, commanded.provenance.settings)
    assert not all(rule.holds for rule in rules)


def test_what_is_no_walk_for_the_robot_is_refused(athlete, walk):
    nowhere = replace(
        walk,
        legs=(),
        stances=walk.stances[:1],
        **{name: getattr(walk, name)[:1] for name in ("waypoints", "Ts_site_base", "moves", "phases")},
        margins=walk.margins[:1],
        torques=walk.torques[:1],
    )
    with pytest.raises(InvalidSequence, match="goes nowhere"):
        make_sequence(nowhere, athlete)
    elsewhere = replace(walk, provenance=replace(walk.provenance, parents={"robot": "0" * 32}))
    with pytest.raises(InvalidSequence, match="made for another robot"):
        make_sequence(elsewhere, athlete)


def test_scripts_need_not_name_the_robot(walk, commanded):
    require_same_commands(make_for_scripts(walk).commands, commanded.commands)


@pytest.mark.parametrize("format", FORMATS)
def test_a_walk_is_exported_in_every_format_and_read_again(athlete, dem, commanded, format):
    content = export(commanded, format)
    assert content
    if format in READ:
        require_same_commands(READ[format](content).commands, commanded.commands)
    if format == "json":
        again = sequence_of("walk.json", content, athlete, dem)
        assert again.valid
        np.testing.assert_allclose(again.poses, commanded.poses, atol=1e-9)
