"""Emergency messages in a family's words."""

from __future__ import annotations

import pytest

from bridge.drive import EmergencyReader
from bridge.mapping import load_family
from bridge.mapping.model import EmcyTable

CODES = {"0000": "no fault", "4310": "motor temperature", "F000": "device specific", "10xx": "generic"}
EVENTS = {"41": "motor temperature (E82)", "52": "communication"}


def reader(**entries: object) -> EmergencyReader:
    emcy = EmcyTable.model_validate({"codes": CODES, "events": EVENTS, **entries})
    return EmergencyReader(load_family("stoeber/5000").model_copy(update={"emcy": emcy}))


STOEBER = reader(event={"byte": 3, "cause_byte": 4, "gone": 30})
LENZE = reader(number={"codes": ["F000", "10xx"], "byte": 4, "size": 4}, events={"7680": "mains phase"})


@pytest.mark.parametrize(
    ("code", "vendor", "text", "number"),
    [
        (0x4310, "29 00 00 00 00", "41 motor temperature (E82)", 41),
        # ID 441684.06 §9.3: the worked example carries 1000h with event 29h.
        (0x1000, "29 02 00 00 00", "41 motor temperature (E82), cause 2", 41),
        (0x1000, "63 00 00 00 00", "event 99, generic", 99),
    ],
)
def test_the_event_number_decides(code: int, vendor: str, text: str, number: int) -> None:
    told = STOEBER.read(code, bytes.fromhex(vendor))
    assert (told.text, told.number, told.is_gone) == (text, number, False)


@pytest.mark.parametrize(("code", "vendor"), [(0, "1E 00 00 00 00"), (0x1000, "1E00000000"), (0, "")])
def test_no_fault_any_more(code: int, vendor: str) -> None:
    assert STOEBER.read(code, bytes.fromhex(vendor)).is_gone


def test_an_error_number_goes_with_some_codes_only() -> None:
    """EDS84DMOTCAN 3.0 §10: bytes 4 … 7 with F000h."""
    told = LENZE.read(0xF000, bytes.fromhex("00 00 1E 00 00"))
    assert (told.text, told.number) == ("7680 mains phase", 7680)
    assert LENZE.read(0x1000, bytes.fromhex("00 05 00 00 00")).text == "error 5, generic"
    assert LENZE.read(0x4310, bytes.fromhex("00 00 1E 00 00")).text == "motor temperature"
    assert LENZE.read(0xF000, bytes(5)).text == "device specific"


@pytest.mark.parametrize("vendor", [b"", b"\x29", bytes(5)])
def test_a_short_message_is_read_as_far_as_it_goes(vendor: bytes) -> None:
    for one in (STOEBER, LENZE):
        assert one.read(0x4310, vendor).text
