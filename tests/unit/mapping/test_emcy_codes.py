"""Emergency codes that no family names have the text of their group (CiA 301 §7.2.7.1)."""

from __future__ import annotations

import pytest

from bridge.mapping import emcy_codes, family_names, load_family

TEXTS = {
    0x0000: "no error",
    0x1000: "generic error",
    0x2099: "current",
    0x2140: "current, device input side",
    0x2310: "current, device output side",
    0x3999: "voltage",
    0x4310: "temperature",
    0x5530: "device hardware",
    0x6320: "data set",
    0x7500: "additional modules",
    0x8000: "monitoring",
    0x8100: "communication",
    0x8130: "life guard error or heartbeat error",
    0x8240: "unexpected SYNC data length",
    0x8260: "protocol error",
    0x9001: "external error",
    0xF001: "additional functions",
    0xFF12: "device specific",
    0x0100: "unknown code",
    0xA000: "unknown code",
    0xF100: "unknown code",
}


@pytest.mark.parametrize("code", TEXTS, ids=lambda code: f"{code:04X}")
def test_a_code_has_the_text_of_its_group(code: int) -> None:
    assert str(emcy_codes.text(code)) == TEXTS[code]


def test_every_class_of_the_standard_has_a_text_in_every_family() -> None:
    """1xxxh … 9xxxh, F0xxh and FFxxh: whatever a family leaves out, nothing of these is unknown."""
    codes = [*range(0x1000, 0xA000, 0x10), *range(0xF000, 0xF100, 0x10), *range(0xFF00, 0x10000, 0x10)]
    for name in family_names():
        emcy = load_family(name).emcy
        assert [f"{code:04X}" for code in codes if emcy.text(code) in ("", emcy_codes.UNKNOWN)] == [], name


def test_the_words_of_a_family_come_first() -> None:
    emcy = load_family("nord/sk-tu4-cao").emcy
    assert str(emcy.text(0x2310)) == "3.0 overcurrent of the inverter"
    assert str(emcy.text(0x8240)) == "unexpected SYNC data length"
    assert str(emcy.text(0x2399)) == "current, device output side"


def test_the_error_register_in_words() -> None:
    """CiA 301 §7.5.2.2; bit 6 is reserved."""
    assert str(emcy_codes.register_text(0)) == "no error"
    assert str(emcy_codes.register_text(0x11)) == "generic error, communication"
    assert str(emcy_codes.register_text(0xFF)) == (
        "generic error, current, voltage, temperature, communication, device profile, bit 6, manufacturer"
    )
