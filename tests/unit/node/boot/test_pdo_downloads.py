"""PDO objects of a downloaded configuration: written in the order of CiA 301 §7.5.2.36, or not at all."""

from __future__ import annotations

import struct

import pytest

from bridge.config.download import Download
from bridge.node.boot.error_status import BootError
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_downloads import download_pdo, is_pdo, pdo_parameter
from tests.support.answering import Answering

OFF = 0x8000_0000


def number(value: int, size: int = 4) -> bytes:
    return value.to_bytes(size, "little")


def node() -> Answering:
    return Answering(
        {
            (0x1800, 0): b"\5",
            (0x1800, 1): number(0x4000_0185),
            (0x1800, 2): b"\xff",
            (0x1800, 5): number(100, 2),
            (0x1A00, 0): b"\2",
            (0x1A00, 1): number(0x6041_0010),
            (0x1A00, 2): number(0x6044_0010),
        }
    )


def test_which_objects_set_a_pdo() -> None:
    """CiA 301 §7.5.1: RPDOs have 1400h … 17FFh, TPDOs 1800h … 1BFFh."""
    assert [is_pdo(index) for index in (0x13FF, 0x1400, 0x17FF, 0x1800, 0x1BFF, 0x1C00)] == [
        False,
        True,
        True,
        True,
        True,
        False,
    ]
    assert pdo_parameter(0x1A05) == pdo_parameter(0x1805) == 0x1805
    assert pdo_parameter(0x1603) == 0x1403


def test_what_the_node_has_already_is_not_written() -> None:
    one, memory = node(), BootMemory()
    wanted = [Download(0x1800, 2, b"\xff"), Download(0x1800, 5, number(100, 2)), Download(0x1A00, 0, b"\2")]
    assert one.run(download_pdo(wanted, memory)) == 0
    assert one.writes == []
    assert not memory.unsaved


def test_whether_it_may_be_asked_for_and_how_long_an_identifier_is_are_the_nodes_own() -> None:
    """Bits 30 and 29 of a COB-ID stay as the node has them."""
    one = node()
    assert one.run(download_pdo([Download(0x1800, 1, number(0x0000_0185))], BootMemory())) == 0


def test_a_setting_is_written_with_the_pdo_off() -> None:
    one, memory = node(), BootMemory()
    assert one.run(download_pdo([Download(0x1800, 5, number(50, 2))], memory)) == 1
    assert memory.unsaved
    assert one.writes[0] == (0x1800, 1, number(0x4000_0185 | OFF))
    assert (0x1800, 5, number(50, 2)) in one.writes
    assert one.writes[-1] == (0x1800, 1, number(0x4000_0185))


def test_a_mapping_is_written_between_two_counts_and_what_is_not_listed_stays() -> None:
    one = node()
    wanted = [Download(0x1A00, 1, number(0x6064_0020))]
    assert one.run(download_pdo(wanted, BootMemory())) == 1
    of_mapping = [(sub, data) for index, sub, data in one.writes if index == 0x1A00]
    assert of_mapping[0] == (0, b"\0")
    assert (1, number(0x6064_0020)) in of_mapping
    assert of_mapping[-1] == (0, b"\2")
    assert one.objects[0x1A00, 2] == number(0x6044_0010)


def test_another_identifier_is_the_last_that_is_written() -> None:
    one = node()
    one.run(download_pdo([Download(0x1800, 1, number(0x285))], BootMemory()))
    assert struct.unpack("<I", one.objects[0x1800, 1])[0] & 0x9FFF_FFFF == 0x285
    assert one.writes[-1][:2] == (0x1800, 1)


def test_a_refused_object_is_named_with_the_letter_j() -> None:
    one = node()
    one.refused.add((0x1800, 5))
    with pytest.raises(BootError) as caught:
        one.run(download_pdo([Download(0x1800, 5, number(50, 2))], BootMemory()))
    assert caught.value.letter == "J"
    assert "1800h:05" in caught.value.detail
    assert not caught.value.detail.startswith("J")
