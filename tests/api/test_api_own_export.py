"""An export is told as done by the page that asked for it, not by some program."""

from footfall.api.assemble import assemble
from footfall.session.jobs.local import InlineJobs
from footfall.session.registry import Sessions
from tests.support.laid_sample import lay_sample
from tests.support.local import Local

PAGE = "0123456789abcdef01234567"


def test_the_event_of_an_export_names_the_page(tmp_path):
    session = lay_sample("edited-export", tmp_path)
    with Sessions(tmp_path, InlineJobs()) as sessions:
        live = sessions.open(session)
        local = Local(assemble(sessions))
        address = f"sequences/{live.state.sequence}/export?format=csv"
        assert local.post(address, headers={"FootFall-Page": PAGE}).status_code == 201
        told = live.events()[-1]
        assert (told.type, told.payload["kind"], told.payload["by"]["page"]) == ("product", "export", PAGE)
        # a program names none
        assert local.post(address).status_code == 201
        assert live.events()[-1].payload["by"]["page"] == ""
