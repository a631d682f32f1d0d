"""Contradictions within a description, reported with the line; right ones give no report."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from bridge.eds import read_device, read_device_file
from bridge.eds.contradictions import contradictions
from bridge.mapping.loader import mappings_dir
from tests.support.invented_eds import SPIN, U16, Section, eds, mapped, pdo, var

HEARTBEAT = "1017"
RPDO = "0x60400010"


def told(**changed: Section) -> list[str]:
    return told_of({**SPIN, **changed})


def told_of(device: Mapping[str, Section]) -> list[str]:
    content = eds(device)
    lines = content.decode().splitlines()
    found = contradictions(read_device(content, "spin.eds"))
    # Each names the section that speaks of it.
    return [f"{lines[one.line - 1]} {one.said}" for one in found]


def test_a_good_file_has_none() -> None:
    assert told() == []


def test_ours_have_none() -> None:
    files = list(mappings_dir().rglob("*.eds"))
    assert files
    for file in files:
        assert not contradictions(read_device_file(file)), file


@pytest.mark.parametrize(
    ("section", "text"),
    [
        (var("beat", U16, LowLimit="9", HighLimit="5"), "LowLimit 9 is above HighLimit 5"),
        (var("beat", U16, default="77", HighLimit="5"), "DefaultValue 77 is above HighLimit 5"),
        (var("beat", U16, default="1", LowLimit="5"), "DefaultValue 1 is below LowLimit 5"),
        (
            var("beat", U16, default="$NODEID+0xFFFF"),
            "$NODEID+0xFFFF of the node 1: 65536 is beyond UNSIGNED16",
        ),
        (
            var("beat", U16, default="$NODEID+0xFF81"),
            "$NODEID+0xFF81 of the node 127: 65536 is beyond UNSIGNED16",
        ),
    ],
)
def test_values_that_cannot_be(section: Section, text: str) -> None:
    assert told(**{HEARTBEAT: section}) == [f"[{HEARTBEAT}] {HEARTBEAT}h:00: {text}"]


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("0x50000010", "5000h:00 is not described"),
        ("0x60400310", "6040h:03 is not described"),
        ("0x60400020", "6040h:00 has 16 bits (UNSIGNED16), not 32"),
        ("0x60410010", "6041h:00 is ro, and this PDO is received"),
    ],
)
def test_a_pdo_that_cannot_be(word: str, text: str) -> None:
    found = told(**pdo("1400", "$NODEID+0x200", word))
    assert found == [f"[1600sub1] 1600h:01 maps {word[2:]}h: {text}"]


def test_a_word_that_nobody_can_read_is_not_sent() -> None:
    secret = {"2010": mapped("secret", U16, "wo")}
    found = told(**secret, **pdo("1800", "$NODEID+0x180", "0x20100010"))
    assert found == ["[1A00sub1] 1A00h:01 maps 20100010h: 2010h:00 is wo, and this PDO is sent"]


def test_more_is_mapped_than_there_is_or_fits() -> None:
    many = pdo("1400", "$NODEID+0x200", *[RPDO] * 5)
    assert told(**many) == ["[1600sub0] 1600h:00 maps 80 bits, and a PDO has at most 64"]
    few = pdo("1400", "$NODEID+0x200", RPDO)
    few["1600sub0"]["DefaultValue"] = "200"
    assert told(**few) == ["[1600sub0] 1600h:00 maps 200 objects, and 3 are described"]


@pytest.mark.parametrize("word", ["0x00050008", "0x0"])
def test_dummies_and_empty_places_are_none(word: str) -> None:
    assert told(**pdo("1400", "$NODEID+0x200", RPDO, word)) == []


def test_an_identifier_that_is_none() -> None:
    found = told(**pdo("1400", "$NODEID+0x7FF", RPDO))
    assert found == ["[1400sub1] 1400h:01: $NODEID+0x7FF of the node 1 is 800h, which is no identifier"]
    assert told(**pdo("1400", "$NODEID+0x80000200", RPDO)) == []
