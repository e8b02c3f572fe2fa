import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.view.requests import Request, RequestError, parse

JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
WORDS = st.sampled_from(["pause", "play", "follow", "speed", "seek", "step", "drawn", "story", "quit"])


def test_the_requests_of_the_page_are_understood() -> None:
    assert parse('{"do": "pause"}') == Request("pause")
    assert parse('{"do": "speed", "value": 10}') == Request("speed", 10.0)
    assert parse('{"do": "speed", "value": null}') == Request("speed", math.inf)
    assert parse('{"do": "seek", "value": 12.5}') == Request("seek", 12.5)
    assert parse('{"do": "step", "value": -10}') == Request("step", -10.0)
    assert parse('{"do": "story", "value": 7, "lane": 1}') == Request("story", 7.0, 1)


@given(
    st.dictionaries(st.sampled_from(["do", "value", "lane"]), JSON | WORDS).map(json.dumps) | st.text() | st.binary()
)
def test_anything_else_is_refused_and_nothing_else_happens(text) -> None:
    try:
        request = parse(text)
    except RequestError:
        return
    assert request.do in ("pause", "play", "follow", "speed", "seek", "step", "drawn", "story")
    assert math.isfinite(request.value) or (request.do == "speed" and request.value > 0.0)


@pytest.mark.parametrize(
    "text", ["[" * 4000, '{"do": "seek", "value": 1' + "0" * 3000 + "}", '{"do": "speed", "value": -1}']
)
def test_requests_made_to_hurt_are_refused(text: str) -> None:
    with pytest.raises(RequestError):
        parse(text)
