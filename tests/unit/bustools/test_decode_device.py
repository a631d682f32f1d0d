"""PDOs of a node that is no drive in words for the monitor: values by name, and frames of other lengths."""

from __future__ import annotations

import pytest

from bridge.bustools.decode_device import DevicePdoView
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.mapping.device_signals import Signal


def signal(name: str, ref: str, kind: str, **more: object) -> Signal:
    return Signal.model_validate({"name": name, "object": ref, "data_type": kind, **more})


POSITION = signal("position", "6004:00", "int32", factor=0.001, unit="rev")
MODE = signal("mode", "2000:00", "uint8", states={"2": "counting"})
READY = signal("ready", "2001:00", "bool")
ENTRIES = (
    PdoEntry(0x6004, 0, 32),
    PdoEntry(0x2000, 0, 8),
    PdoEntry(0x0005, 0, 8),
    PdoEntry(0x2345, 1, 8),
)
VIEW = DevicePdoView(20, "TPDO1 shaft", PdoCodec(ENTRIES, {(0x6004, 0)}), (POSITION, MODE, None, None))


def said(data: str) -> tuple[str, tuple[tuple[str, object], ...]]:
    return VIEW.said(bytes.fromhex(data))


def test_values_have_their_units_and_texts_and_what_nobody_knows_its_number() -> None:
    text, values = said("24FAFFFF02FF0A")
    assert text == "position -1.5 rev, mode 2 counting, 2345:01 Ah"
    assert values == (("position", -1.5), ("mode", 2))


@pytest.mark.parametrize(
    ("data", "text"),
    [
        ("E803000002", "position 1 rev, mode 2 counting, 5 bytes instead of 7"),
        ("E803", "2 bytes instead of 7"),
        ("", "0 bytes instead of 7"),
        ("E803000002000A00", "position 1 rev, mode 2 counting, 2345:01 Ah, 8 bytes instead of 7"),
    ],
)
def test_a_frame_of_another_length_is_read_as_far_as_it_goes(data: str, text: str) -> None:
    assert said(data)[0] == text


def test_a_flag_is_true_or_false_and_a_number_without_a_text_is_itself() -> None:
    view = DevicePdoView(20, "x", PdoCodec((PdoEntry(0x2001, 0, 8),)), (READY,))
    assert view.said(b"\1") == ("ready true", (("ready", True),))
    assert said("0000000009")[0].startswith("position 0 rev, mode 9,")
