"""A session as a page: what goes in comes out to the last character, and nothing in it is markup."""

import base64
import hashlib
import json
import re

from hypothesis import given
from hypothesis import strategies as st

from footfall.io.session_page import encode
from tests.support.sequences import HOSTILE

texts = st.sampled_from([*HOSTILE, "{{story}}", "{{script}}", "<!--<script>"]) | st.text(
    st.characters(exclude_categories=("Cs",)), max_size=30
)
stories = st.fixed_dictionaries(
    {"name": texts, "events": st.lists(st.fixed_dictionaries({"text": texts, "time": st.floats(0, 2e9)}), max_size=3)}
)


@given(stories)
def test_a_page_carries_its_story_whole_and_as_no_markup(story: dict) -> None:
    page = encode(story).decode()
    (told,) = re.findall(r'<script type="application/json" id="story">(.*?)</script>', page, re.S)
    assert json.loads(told) == story
    assert not set("<>&\u2028\u2029") & set(told)
    # the title and the two scripts are all that stands beside the template
    assert page.count("</title>") == 1
    assert len(re.findall("<script", page)) == 2


def test_the_page_allows_its_own_script_alone() -> None:
    page = encode({"name": "a", "events": []}).decode()
    script = re.findall(r"<script>(.*?)</script>", page, re.S)[0]
    allowed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy.startswith("default-src 'none';")
    assert policy.endswith(f"script-src 'sha256-{allowed}'")
    assert not re.findall(r"(?:src|href)\s*=", page.replace(script, ""))
    assert "http" not in script
