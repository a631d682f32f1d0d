"""Identifiers by which the drives of a node are commanded, and what a frame on one of them asks."""

from __future__ import annotations

import pytest

from bridge.node.boot import BootMemory
from bridge.node.process.command_frames import CommandFrame, commands_of
from bridge.node.process.stop_words import StopWords
from tests.support import sites
from tests.support.nodes import node_of

RUN, SHUT_DOWN = 0x047F, 0x047E
"""NORD's (BU 2500 §6.8)."""


@pytest.fixture
def found() -> dict[int, CommandFrame]:
    node = node_of(sites.drive("fu1", "none", 0, ""))
    return commands_of(node, {}, StopWords(node, (), BootMemory()))


def frame(word: int, length: int = 8) -> bytes:
    return word.to_bytes(2, "little").ljust(length, b"\0")


def test_a_drive_that_is_not_connected_may_listen_as_the_factory_has_it(
    found: dict[int, CommandFrame],
) -> None:
    assert str(found[0x205].label) == "RPDO of conveyor/fu1"


def test_drives_that_the_site_leaves_out_are_there_too(found: dict[int, CommandFrame]) -> None:
    labels = {str(command.label) for command in found.values()}
    others = {slot.name for slot in sites.family(sites.FAMILY).slot} - {"fu1"}
    assert {f"RPDO of conveyor, {name}" for name in others} <= labels


@pytest.mark.parametrize(("word", "enables"), [(RUN, True), (SHUT_DOWN, False), (0, False)])
def test_a_frame_says_whether_it_enables(found: dict[int, CommandFrame], word: int, enables: bool) -> None:
    command = found[0x205]
    assert command.enables(frame(word)) is enables
    does = "enables" if enables else "does not enable"
    assert str(command.said(frame(word))).endswith(f"control word {word:04X}h, which {does}")


def test_one_without_a_control_word_is_its_bytes(found: dict[int, CommandFrame]) -> None:
    assert found[0x205].said(b"\x7f") == "7F"
    assert not found[0x205].enables(b"\x7f")
