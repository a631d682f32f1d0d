"""Fields of events in a file and back."""

from __future__ import annotations

import json

import pytest
from asyncua import ua

from bridge.northbound.opcua.events.event_records import EventCodec, read_record
from bridge.uaserver.languages import speaking
from tests.support.opcua_events import URIS, Kind, fields, record


def test_what_is_read_is_what_was_written() -> None:
    line = record(7).line
    found = read_record(line)
    assert found == record(7)
    assert EventCodec(URIS).fields(found) == fields(7)
    assert line.endswith(b"\n")
    assert line.count(b"\n") == 1


def test_a_line_feed_of_a_text_is_not_the_end_of_a_line() -> None:
    assert record(1, words="two\nlines").line.count(b"\n") == 1


def test_everybody_gets_the_text_in_their_language() -> None:
    message = EventCodec(URIS).fields(record(7))["Message"].Value
    assert message.Text == "lost"
    with speaking(["de"]):
        assert message.Text == "lost auf Deutsch"


def test_a_text_in_one_language_stays_so() -> None:
    codec = EventCodec(URIS)
    for said in (ua.LocalizedText("lost", "en"), ua.LocalizedText()):
        made = codec.record(1, "pump", {"Message": ua.Variant(said, Kind.LocalizedText)})
        assert codec.fields(made)["Message"].Value == said


def test_node_ids_and_names_are_found_where_their_namespace_is_by_then() -> None:
    moved = EventCodec((URIS[0], URIS[1], "urn:other", URIS[2])).fields(record(1))
    assert moved["EventType"].Value == ua.NodeId("NodeLostEventType", 3)
    assert moved["3:Code"].Value == "node.lost"
    assert "2:Code" not in moved
    gone = EventCodec(URIS[:2]).fields(record(1))
    assert gone["EventType"].Value is None
    assert not any("Code" in name for name in gone)


@pytest.mark.parametrize(
    "held", [ua.Variant([1, 2], Kind.Int32), ua.Variant(ua.Range(), Kind.ExtensionObject)], ids=str
)
def test_a_field_of_another_type_is_left_out(held: ua.Variant) -> None:
    codec = EventCodec(URIS)
    made = codec.record(1, "pump", {"Value": held} | fields(1))
    assert codec.fields(made) == fields(1)


@pytest.mark.parametrize(
    "line",
    [
        record(1).line[:-20],
        record(1).line[:-1],
        b"\n",
        b"\xff\xfe\n",
        b"[]\n",
        b"{}\n",
        json.dumps({"time_us": "1", "source": "pump", "fields": {}}).encode() + b"\n",
        json.dumps({"time_us": 1, "source": 5, "fields": {}}).encode() + b"\n",
        json.dumps({"time_us": 1, "source": "pump", "fields": []}).encode() + b"\n",
    ],
)
def test_a_line_that_is_no_record_is_none(line: bytes) -> None:
    assert read_record(line) is None
