"""A text: a code with facts."""

from __future__ import annotations

import msgspec

from bridge.text import Text, as_json, from_json, render


def test_equal_codes_and_facts_are_the_same_text() -> None:
    lost = Text.of("request.by", action=Text.word("action", "stop"), who="local:anna")
    assert lost == Text.of("request.by", action=Text.word("action", "stop"), who="local:anna")
    assert len({lost, Text.of("request.by", action=Text.word("action", "stop"), who="local:anna")}) == 1
    assert lost != Text.of("request.by", action=Text.word("action", "start"), who="local:anna")


def test_a_word_has_a_code_of_its_group() -> None:
    assert Text.word("controller_state", "bus-off") == Text("controller_state.bus_off")
    assert Text.word("node_state", "not seen yet").code == "node_state.not_seen_yet"


def test_a_text_in_a_sentence_reads_in_english() -> None:
    stop = Text.of("request.by", action=Text.word("action", "stop"), who="local:anna")
    assert f"({stop})" == f"({render(stop)})"


def test_a_sentence_stays_itself_and_a_text_too() -> None:
    assert render(Text.plain("Kabel")) == "Kabel"
    assert Text.plain(Text.of("node.lost")) == Text.of("node.lost")


def test_json_has_the_facts_by_name_also_of_texts_within_texts() -> None:
    one, other = Text.of("meaning.other", leaf="speed"), Text.of("meaning.other_scale", leaf="torque")
    said = Text.of("meaning.lost", parameter="P1", in_set=2, before=1.5, affected=(one, other))
    assert as_json(said) == {
        "code": "meaning.lost",
        "facts": {
            "parameter": "P1",
            "in_set": 2,
            "before": 1.5,
            "affected": [
                {"code": "meaning.other", "facts": {"leaf": "speed"}},
                {"code": "meaning.other_scale", "facts": {"leaf": "torque"}},
            ],
        },
    }
    assert as_json("a sentence") is None


def test_a_text_comes_through_messagepack_as_it_is() -> None:
    inner = Text.of("meaning.other", leaf="speed")
    said = Text.of("meaning.lost", parameter="P1", in_set=2, before=1.0, affected=(inner,))
    back = msgspec.msgpack.decode(msgspec.msgpack.encode(said), type=Text)
    assert back == said
    assert render(back) == render(said)


def test_json_is_the_text_again() -> None:
    inner = Text.of("front.fails", front="zenoh", how=Text.of("front.has_ended"))
    whole = Text.of("front.failing", parts=(inner, inner))
    told = as_json(whole)
    assert told is not None
    assert from_json(told) == whole
