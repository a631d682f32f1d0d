"""LSS in words for the monitor (CiA 305): command specifiers and what is behind them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.decode_lss import said

MASTER, SLAVE = True, False


@pytest.mark.parametrize(
    ("by_master", "data", "text", "values"),
    [
        (MASTER, "0400000000000000", "switch state global: waiting", {"state": "waiting"}),
        (MASTER, "0401000000000000", "switch state global: configuration", {"state": "configuration"}),
        (MASTER, "0407000000000000", "switch state global: unknown state 7", {}),
        (MASTER, "1105000000000000", "configure node id: 5", {"node_id": 5}),
        (MASTER, "11FF000000000000", "configure node id: none", {"node_id": 255}),
        (SLAVE, "1100000000000000", "configure node id: done", {"error": 0}),
        (SLAVE, "1101000000000000", "configure node id: a node id must be 1…127 or 255", {"error": 1}),
        (
            MASTER,
            "1300030000000000",
            "configure bit timing: 250000 bit/s (table 0, index 3)",
            {"bit_rate": 250_000},
        ),
        (MASTER, "1300090000000000", "configure bit timing: automatic (table 0, index 9)", {}),
        (MASTER, "1300050000000000", "configure bit timing: table 0, index 5", {}),
        (MASTER, "1381020000000000", "configure bit timing: table 129, index 2", {}),
        (SLAVE, "1301000000000000", "configure bit timing: this bit rate is not supported", {"error": 1}),
        (MASTER, "15E8030000000000", "activate bit timing: after 1000 ms", {"delay_ms": 1000}),
        (MASTER, "1700000000000000", "store configuration", {}),
        (SLAVE, "1702000000000000", "store configuration: access to its memory failed", {"error": 2}),
        (SLAVE, "17FF2A0000000000", "store configuration: its own error 42", {"error": 255}),
        (SLAVE, "1744000000000000", "store configuration: error 68", {"error": 68}),
        (MASTER, "407B000000000000", "switch selective: vendor id 0000007Bh", {"number": 0x7B}),
        (MASTER, "4378563412000000", "switch selective: serial number 12345678h", {"number": 0x12345678}),
        (SLAVE, "4400000000000000", "switch selective: selected", {}),
        (MASTER, "467B000000000000", "identify: vendor id 0000007Bh", {"number": 0x7B}),
        (MASTER, "4701000000000000", "identify: product code 00000001h", {"number": 1}),
        (MASTER, "4802000000000000", "identify: lowest revision number 00000002h", {"number": 2}),
        (MASTER, "4903000000000000", "identify: highest revision number 00000003h", {"number": 3}),
        (MASTER, "4A04000000000000", "identify: lowest serial number 00000004h", {"number": 4}),
        (MASTER, "4B05000000000000", "identify: highest serial number 00000005h", {"number": 5}),
        (MASTER, "4C00000000000000", "identify: whoever has no node id", {}),
        (SLAVE, "4F00000000000000", "identified", {}),
        (SLAVE, "5000000000000000", "identified: it has no node id", {}),
        (MASTER, "5100000000800000", "fastscan: is anybody there?", {}),
        (
            MASTER,
            "51000000801F0001",
            "fastscan: vendor id, bits 31…31 as in 80000000h",
            {"number": 0x80000000, "bit": 31},
        ),
        (
            MASTER,
            "517B000000000001",
            "fastscan: vendor id, bits 0…31 as in 0000007Bh",
            {"number": 0x7B, "bit": 0},
        ),
        (MASTER, "5178563412050400", "fastscan: 78 56 34 12 05 04 00", {}),
        (MASTER, "5178563412200000", "fastscan: 78 56 34 12 20 00 00", {}),
        (MASTER, "517B000000000901", "fastscan: 7B 00 00 00 00 09 01", {}),
        (MASTER, "5A00000000000000", "inquire vendor id", {}),
        (SLAVE, "5A7B000000000000", "inquire vendor id: 0000007Bh", {"number": 0x7B}),
        (SLAVE, "5D78563412000000", "inquire serial number: 12345678h", {"number": 0x12345678}),
        (MASTER, "5E00000000000000", "inquire node id", {}),
        (SLAVE, "5E05000000000000", "inquire node id: 5", {"node_id": 5}),
        (SLAVE, "5EFF000000000000", "inquire node id: none", {"node_id": 255}),
        (MASTER, "7701000000000000", "command 77h: 01 00 00 00 00 00 00", {}),
        (MASTER, "04", "1 byte instead of 8", {}),
        (SLAVE, "", "0 bytes instead of 8", {}),
    ],
)
def test_commands_and_what_is_behind_them(
    by_master: bool, data: str, text: str, values: dict[str, int | str]
) -> None:
    sentence, facts = said(bytes.fromhex(data), by_master=by_master)
    assert sentence == text
    assert dict(facts) == values


@given(st.binary(max_size=8), st.booleans())
def test_no_message_is_too_odd(data: bytes, by_master: bool) -> None:
    assert said(data, by_master=by_master)[0]
