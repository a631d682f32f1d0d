"""Refusals of the page's server: English for everybody, and the code for who reads another language."""

from __future__ import annotations

import json

from bridge.northbound.page.refused import BodyTooLong, refused
from bridge.text import Text


def test_a_refusal_is_english_beside_its_code_with_facts() -> None:
    answer = refused(404, Text.of("page.there_is", known=("can0", "can1")))
    assert answer.status_code == 404
    assert json.loads(bytes(answer.body)) == {
        "error": "there is can0, can1",
        "text": {"code": "page.there_is", "facts": {"known": ["can0", "can1"]}},
    }


def test_somebody_elses_words_have_no_code() -> None:
    assert json.loads(bytes(refused(400, "JSON is malformed").body)) == {"error": "JSON is malformed"}


def test_a_body_that_is_too_long_says_so() -> None:
    assert str(BodyTooLong()) == "too long"
