"""What the page without a server tells of commands: how far those that it lists came, and no others."""

from pathlib import Path

import pytest

from footfall.cli.recorded import RecordedSession
from footfall.session.log.event import next_event
from footfall.session.replay.page_story import page_story

SAMPLES = Path(__file__).resolve().parents[2] / "sample_sessions"


@pytest.fixture(scope="module")
def rock():
    return RecordedSession(SAMPLES / "rock-step")


def story_after(rock, *happened):
    """The story of the sample and what happened after it, (type, payload) each."""
    events = list(rock.events)
    for type, payload in happened:
        events.append(next_event(events[-1], events[-1].time + 1.0, type, payload))
    return page_story(events, rock.typed, rock.robot())


def sent(sequence, run, *ends):
    """A run of a sequence whose rows ended so, as (type, payload)."""
    yield "run_started", {"run": run, "sequence": sequence, "rows": len(ends), "mode": "whole"}
    for row, end in enumerate(ends):
        told = {"id": f"{run}-{row}", "reason": "too warm" if end == "refused" else ""}
        yield "command_sent", {"id": f"{run}-{row}", "sequence": sequence, "run": run, "row": row}
        yield f"command_{end}", told


def test_rows_have_the_states_of_the_latest_run_of_these_commands(rock):
    mine = rock.state.sequence
    assert story_after(rock)["commands"] == []
    told = story_after(rock, *sent(mine, 1, "done", "done", "done"), *sent(mine, 2, "done", "refused"))
    assert [(one["row"], one["state"], one["reason"]) for one in told["commands"]] == [
        (0, "done", ""),
        (1, "failed", "too warm"),
    ]
    assert [event["text"] for event in told["events"][-4:]] == [
        "row 1 released",
        "row 1 done",
        "row 2 released",
        "row 2 failed: too warm",
    ]


def test_rows_of_other_commands_say_nothing_of_these(rock):
    assert story_after(rock, *sent("0" * 32, 1, "done", "done"))["commands"] == []
