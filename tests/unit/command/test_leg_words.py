"""The words that the exploration's oracle goes by, from the manuals, against those of the mapping files."""

from __future__ import annotations

import pytest

from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.mapping import load_family
from tests.support.leg_words import ALL, Bits, LegWords

WORDS = range(0x1_0000)

families = pytest.mark.parametrize("words", ALL, ids=lambda words: words.mapping)


def all_that(fit: Bits) -> set[int]:
    return {word for word in WORDS if fit.fit(word)}


@families
def test_the_same_control_words_enable(words: LegWords):
    control = ControlWords(load_family(words.mapping).control_word)
    assert {word for word in WORDS if control.enables(word)} == all_that(words.enabling)
    assert {word for word in WORDS if control.is_valid(word)} == all_that(Bits(words.valid, words.valid))


@families
def test_the_words_that_lead_a_drive_are_the_same(words: LegWords):
    model = load_family(words.mapping).control_word
    assert (model.ready, model.run) == (words.shut_down, words.enable)
    assert 1 << model.acknowledge_bit == words.acknowledge
    assert model.begin == words.begin
    handshake = model.handshake
    bits = (1 << handshake.bit, 1 << handshake.acknowledge_bit) if handshake else (0, 0)
    assert bits == (words.handshake, words.taken)


@families
def test_a_stop_looks_as_the_manual_has_it_whatever_it_is_made_from(words: LegWords):
    control = ControlWords(load_family(words.mapping).control_word)
    for word in all_that(words.enabling):
        assert words.stop.fit(control.stop(word))
        assert words.quick_stop.fit(control.quick_stop(word))
        assert words.disable_voltage.fit(control.disable_voltage(word))


@families
def test_no_stop_enables(words: LegWords):
    for stop in (words.stop, words.quick_stop, words.disable_voltage):
        common = stop.mask & words.enabling.mask
        assert stop.value & common != words.enabling.value & common


@families
def test_the_status_words_are_understood(words: LegWords):
    status = StatusWords(load_family(words.mapping).status_word)
    assert status.state(words.ready) is DriveState.READY
    assert status.state(words.enabled) is DriveState.OPERATION_ENABLED
    assert status.state(words.fault) is DriveState.FAULT
    assert all(status.state(word) is DriveState.FAULT for word in all_that(words.in_fault))
