"""Further SDO servers of a node (CiA 301 §7.5.2.33): opened where the site asks for them, and read back."""

from __future__ import annotations

import pytest

from bridge.canopen.nmt import NmtCommand
from bridge.node.boot.actions import BootResult, SendNmt
from bridge.node.boot.error_status import BootError
from bridge.node.boot.sdo_servers import open_sdo_servers
from bridge.text import render
from tests.support.answering import Answering
from tests.support.nodes import node_of

CLOSED = 0x8000_0000


def number(value: int) -> bytes:
    return value.to_bytes(4, "little")


def test_without_a_channel_in_the_site_file_nothing_is_asked() -> None:
    node = Answering()
    node.run(open_sdo_servers(node_of(), BootResult()))
    assert (node.reads, node.writes) == ([], [])


def opened(node: Answering, result: BootResult | None = None) -> BootResult:
    result = result or BootResult()
    node.run(open_sdo_servers(node_of(more="sdo_channels = [3]"), result))
    return result


def test_a_channel_that_is_off_is_switched_on_with_the_mappings_identifiers() -> None:
    """BU 2500 §6.4: SDO3 is 440h and 3C0h + node id."""
    node = Answering({(0x1202, 1): number(CLOSED), (0x1202, 2): number(CLOSED)})
    result = opened(node)
    assert node.writes == [(0x1202, 1, number(0x445)), (0x1202, 2, number(0x3C5))]
    assert [*map(render, result.notes)] == ["SDO channel 3 opened at 445h/3C5h"]


def test_one_that_is_open_as_wanted_is_not_touched() -> None:
    node = Answering({(0x1202, 1): number(0x445), (0x1202, 2): number(0x3C5)})
    assert opened(node).notes == []
    assert node.writes == []
    assert SendNmt(NmtCommand.STOP) not in node.said


def test_an_identifier_in_use_is_switched_off_before_it_changes() -> None:
    node = Answering({(0x1202, 1): number(0x446), (0x1202, 2): number(0x3C5)})
    opened(node)
    assert node.writes == [(0x1202, 1, number(CLOSED | 0x446)), (0x1202, 1, number(0x445))]


def test_a_refusal_is_j_with_the_channel() -> None:
    node = Answering({(0x1202, 1): number(CLOSED), (0x1202, 2): number(CLOSED)})
    node.refused = {(0x1202, 1)}
    with pytest.raises(BootError) as caught:
        opened(node)
    assert caught.value.letter == "J"
    assert caught.value.detail.startswith("SDO channel 3 cannot be opened: 1202h:01")


class Deaf(Answering):
    """Says that it takes what is written, and does not."""

    def _answer(self, asked: object) -> object:  # type: ignore[override]
        return b"" if hasattr(asked, "data") else super()._answer(asked)


def test_what_the_node_does_not_keep_is_j_with_both() -> None:
    node = Deaf({(0x1202, 1): number(CLOSED), (0x1202, 2): number(CLOSED)})
    with pytest.raises(BootError, match="1202h:01 is 80000000h, expected 00000445h"):
        opened(node)
