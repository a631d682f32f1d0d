"""Reasons why a bus cannot be opened, in words that name the remedy."""

from __future__ import annotations

from bridge.can.explain import WrongBitrate, explain


def test_the_wrong_bit_rate_is_told_with_what_helps() -> None:
    text = str(explain(WrongBitrate("can0", 500_000, 250_000), "can0"))
    assert "can0 runs at 500000 bit/s, the site file says 250000" in text
    assert "ip link set can0 up type can bitrate 250000" in text
