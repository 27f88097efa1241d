"""The least clearances of a run, told beside what came of it: as the schema says, and whoever asks when."""

import pytest
from jsonschema import Draft202012Validator

from footfall.session.registry import Sessions
from tests.support.server import running_server
from tests.support.spoken import current
from tests.support.swinging import Swinging
from tests.support.undeclared import undeclared
from tests.support.waiting import until


@pytest.mark.parametrize("name", ["rock-step", "fractal-step"])
def test_they_are_told_with_the_run_as_the_schema_says(name, tmp_path):
    """On fractal ground the pose is held: all joints move in the rows of the swing."""

    def sample(sessions: Sessions) -> None:
        sessions.open_sample(name)

    with running_server(tmp_path, prepare=sample) as running, running.client() as client:
        document = client.get("/openapi.json").json()
        (path,) = (one for one in document["paths"] if one.endswith("/sessions/{session}/run"))
        answers = document["paths"][path]["get"]["responses"]["200"]["content"]["application/json"]
        schema = answers["schema"]
        swinging, run = Swinging(current(running)), current(running).state.runs + 1

        def told():
            answer = client.get("/sessions/current/run").json()
            assert undeclared(answer, schema, document) == []
            Draft202012Validator({**schema, "components": document["components"]}).validate(answer)
            return answer["least_clearances"]

        swinging.begin(run)
        assert told()["wheels"] == []
        swinging.send(run, swinging.row)
        swinging.tell(1.0)
        found = until(lambda: told()["wheels"] and told(), "the wheel that swings")
        assert [one["leg"] for one in found["wheels"]] == [swinging.leg]
        (now,) = client.get("/sessions/current/clearance").json()["wheels"]
        assert found["wheels"][0]["measured"] == now["measured"]
        swinging.end(run)
        swinging.tell(2.0, lower=0.1)
        assert told() == found
        assert client.get("/sessions/current").json()["run"]["least_clearances"] == found
