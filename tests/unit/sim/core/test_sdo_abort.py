"""Abort codes as they are on the wire."""

from __future__ import annotations

from bridge.sim.core.sdo_abort import AbortCode, SdoAbort


def test_an_abort_names_its_code() -> None:
    assert str(SdoAbort(AbortCode.READ_ONLY)) == "READ_ONLY 06010002h"
    assert str(SdoAbort(0x08000000)) == "08000000h"


def test_no_code_stands_for_two_reasons() -> None:
    assert len({code.value for code in AbortCode}) == len(AbortCode.__members__)
