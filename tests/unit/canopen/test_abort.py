"""SDO abort codes (CiA 301 §7.2.4.3.17) against canopen's table, and what they are for."""

from __future__ import annotations

from canopen.sdo.exceptions import SdoAbortedError

from bridge.canopen import abort


def test_the_abort_codes() -> None:
    assert set(abort.TEXTS) == set(SdoAbortedError.CODES)
    assert len(set(abort.TEXTS.values())) == len(abort.TEXTS)
    assert abort.text(0x1234_5678) == "unknown abort code"


def test_what_the_abort_codes_are_for() -> None:
    assert {abort.text(code) for code in abort.TRANSIENT} == {
        "toggle bit not alternated",
        "SDO protocol timed out",
        "invalid block size",
        "invalid sequence number",
        "CRC error",
        "data type does not match, length of service parameter too high",
        "data type does not match, length of service parameter too low",
    }
    assert abort.text(abort.UNKNOWN_COMMAND) == "client/server command specifier not valid or unknown"
    assert abort.text(abort.OUT_OF_MEMORY) == "out of memory"
    assert abort.text(abort.BUSY) == "resource not available: SDO connection"
    assert abort.text(abort.GENERAL) == "general error"
