"""The text of a DBC file: read back by cantools, in ASCII, with what people have written in words."""

from __future__ import annotations

import cantools
import pytest
from cantools.database.can import Database

from bridge.dbc.model import BusDescription, Message, MessageSignal
from bridge.dbc.write import dbc_text


def read(*messages: Message, comment: str = "") -> Database:
    bus = BusDescription("can0", 500_000, comment, {"DRIVEBRIDGE": "the bridge", "conveyor": ""}, messages)
    text = dbc_text(bus)
    text.encode("ascii")
    found = cantools.database.load_string(text, "dbc")
    assert isinstance(found, Database)
    return found


def message(*signals: MessageSignal, **more: object) -> Message:
    return Message(0x185, "TPDO1", 8, "conveyor", ("DRIVEBRIDGE",), signals, **more)  # type: ignore[arg-type]


def test_a_message_is_read_back_with_its_times_and_who_sends_it() -> None:
    found = read(
        message(MessageSignal("status_word", 0, 16), cycle_ms=100, comment="said")
    ).get_message_by_name("TPDO1")
    assert (found.frame_id, found.length, found.senders, found.cycle_time) == (0x185, 8, ["conveyor"], 100)
    assert found.comment == "said"
    assert found.signals[0].receivers == ["DRIVEBRIDGE"]


def test_a_value_is_scaled_and_limited_without_the_digits_of_multiplying() -> None:
    signal = MessageSignal("speed", 16, 16, True, 0.1, -5.0, 0.1 * 3, 50.0, "Hz")
    (found,) = read(message(signal)).messages[0].signals
    assert (found.start, found.is_signed, found.byte_order) == (16, True, "little_endian")
    assert (found.conversion.scale, found.conversion.offset) == (0.1, -5)
    assert (found.minimum, found.maximum, found.unit) == (0.3, 50, "Hz")


def test_a_real_number_is_one() -> None:
    (found,) = read(message(MessageSignal("torque", 0, 32, is_float=True))).messages[0].signals
    assert found.conversion.is_float
    assert found.is_signed


def test_texts_of_an_enumeration_are_choices() -> None:
    (found,) = read(message(MessageSignal("state", 0, 8, choices={0: "off", 1: ""}))).messages[0].signals
    assert found.choices is not None
    assert {number: str(text) for number, text in found.choices.items()} == {0: "off", 1: "-"}


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("Förderband Größe", "Foerderband Groesse"),
        ("5 °C → 10 µm", "5 degC -> 10 um"),
        ('a "b" \\c', "a 'b' /c"),
        ("two\nlines", "two lines"),
        ("電", "?"),
        ("é", "e"),
    ],
)
def test_words_are_in_ascii_and_on_one_line(text: str, plain: str) -> None:
    assert read(message(comment=text)).messages[0].comment == plain


def test_signals_that_belong_together_are_a_group() -> None:
    signals = (MessageSignal("ready", 0, 1), MessageSignal("fault", 3, 1))
    (found,) = read(message(*signals, groups={"status_word": ("ready", "fault")})).messages
    assert found.signal_groups is not None
    assert [(one.name, sorted(one.signal_names)) for one in found.signal_groups] == [
        ("status_word", ["fault", "ready"])
    ]


def test_a_name_that_is_too_long_for_the_format_is_kept() -> None:
    name = "a_name_that_is_longer_than_32_characters"
    assert read(message(MessageSignal(name, 0, 8))).messages[0].signals[0].name == name
