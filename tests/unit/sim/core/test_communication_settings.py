"""Settings of communication objects."""

from __future__ import annotations

import pytest

from bridge.sim.core.communication_settings import CobId, PdoSettings, SdoSettings


@pytest.mark.parametrize(("word", "cob_id", "enabled"), [(0x185, 0x185, True), (0x8000_0185, 0x185, False)])
def test_bit_31_switches_a_cob_id_off(word: int, cob_id: int, enabled: bool) -> None:
    made = CobId.of(word)
    assert (made.cob_id, made.enabled, made.word) == (cob_id, enabled, word)
    made.word = word ^ 0x8000_0000
    assert made.enabled is not enabled


def test_only_what_is_counted_is_mapped() -> None:
    pdo = PdoSettings(0x185, entries=[0x6041_0010, 0x6064_0020, 0], count=2)
    assert pdo.mapping == [0x6041_0010, 0x6064_0020]
    assert pdo.mapped_bits == 48


def test_a_channel_is_on_while_both_halves_are() -> None:
    channel = SdoSettings.at(0x625, 0x5A5)
    assert channel.enabled
    channel.send.enabled = False
    assert not channel.enabled
    assert not SdoSettings.at(0x625, 0x5A5, enabled=False).enabled
