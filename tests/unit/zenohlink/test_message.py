"""Messages of zenoh in our own types, and its errors without places in its source."""

from __future__ import annotations

import pytest

from bridge.zenohlink.message import Sample, sentence


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "Can not create a new TCP listener at /root/x/src/unicast.rs:301.",
            "Can not create a new TCP listener",
        ),
        ("a at /x/y.rs:1. b at /z.rs:22", "a b"),
        ("  plain  ", "plain"),
    ],
)
def test_what_is_for_zenohs_authors_is_left_out(text: str, said: str) -> None:
    assert sentence(ValueError(text)) == said


def test_a_message_has_no_more_than_key_and_payload_unless_it_says_so() -> None:
    message = Sample("a/b", b"1")
    assert (message.encoding, message.attachment, message.source) == ("", None, "")
    assert message == Sample("a/b", b"1")
