"""What others see of the leg, in every family: a trip is a fault, and reading changes nothing."""

from __future__ import annotations

import pytest

from bridge.command import Action
from bridge.command.drive_link import NodeState
from bridge.drive import DriveState
from tests.support.leg_words import ALL, LegWords
from tests.support.rig import Rig

families = pytest.mark.parametrize("words", ALL, ids=lambda words: words.mapping)


def enabled(words: LegWords) -> Rig:
    rig = Rig(words=words, pdo_deadline_s=60.0)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(words.ready)
    assert rig.write(words.shut_down).ok
    assert rig.write(words.enable).forwarded
    rig.drive_says(words.enabled)
    return rig


@families
def test_while_tripped_the_served_status_word_says_fault(words: LegWords) -> None:
    rig = enabled(words)
    for is_tripped in (False, True):
        for word in (words.ready, words.enabled, words.fault, words.enabled | words.taken):
            rig.drive_says(word)
            served, mask = rig.channel.status_word, words.in_fault.mask
            assert rig.channel.drive_status_word == word
            assert rig.channel.is_tripped is is_tripped
            if is_tripped:
                assert words.in_fault.fit(served)
                assert (served ^ word) & ~mask == 0, "its other bits are the drive's"
                assert rig.channel.served_state is DriveState.FAULT
            else:
                assert served == word
        rig.wait(0.5)


@families
def test_reading_changes_nothing(words: LegWords) -> None:
    read, unread = enabled(words), enabled(words)
    for pause in (0.0, 0.1, 0.15, 20.0):
        for rig in (read, unread):
            rig.wait(pause)
        names = [
            name for name in dir(read.channel) if isinstance(getattr(type(read.channel), name, 0), property)
        ]
        assert len(names) > 10
        first = [getattr(read.channel, name) for name in names]
        read.channel.next_deadline(read.now)
        read.channel.output_then()
        assert [getattr(read.channel, name) for name in names] == first
        assert [getattr(unread.channel, name) for name in names] == first
    assert read.submit(Action.RESET_FAULT) == unread.submit(Action.RESET_FAULT)
    assert read.channel.output == unread.channel.output
