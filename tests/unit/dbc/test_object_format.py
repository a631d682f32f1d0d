"""Every object of a PDO has in the DBC file the sign, the format and the name that its description gives."""

from __future__ import annotations

from pathlib import Path

import pytest
from cantools import database

from bridge.exports import dbc_file
from bridge.project import load_project
from tests.support import sites
from tests.support.devices import DEVICES
from tests.support.invented_eds import (
    BASIC,
    I8,
    I16,
    I32,
    NODE_ID,
    REAL32,
    U8,
    U16,
    U32,
    eds,
    mapped,
    pdo,
    var,
)  # fmt: skip

TYPES = {
    I8: (8, True, False),
    I16: (16, True, False),
    I32: (32, True, False),
    U8: (8, False, False),
    U16: (16, False, False),
    U32: (32, False, False),
    REAL32: (32, True, True),
}


def signals_of(folder: Path, file: str) -> dict[str, dict[str, tuple[int, bool, bool]]]:
    """Length, sign and format of each signal, by message and name."""
    node = sites.node(name="io", node_id=NODE_ID, mapping=f"eds:{file}")
    project = load_project(sites.write(folder, sites.bus(node)))
    found = database.load_string(dbc_file(project, 0), "dbc")
    assert isinstance(found, database.Database)
    return {
        message.name: {one.name: (one.length, one.is_signed, one.is_float) for one in message.signals}
        for message in found.messages
    }


@pytest.mark.landing(14)
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("receives", [True, False])
def test_a_type_is_the_same_in_both_directions(tmp_path: Path, kind: str, receives: bool) -> None:
    bits = TYPES[kind][0]
    number, base = ("1400", "$NODEID+0x200") if receives else ("1800", "$NODEID+0x180")
    sections = {
        **BASIC,
        "1000": var("device type", U32, "ro", "0x20191"),
        **pdo(number, base, f"0x2014{0:02X}{bits:02X}"),
        "2014": mapped("Flow", kind, "rw" if receives else "ro"),
    }
    (tmp_path / "flow.eds").write_bytes(eds(sections))
    name = f"io_{'RPDO' if receives else 'TPDO'}1"
    assert signals_of(tmp_path, "flow.eds")[name] == {"flow": TYPES[kind]}


def test_outputs_have_their_names_bits_and_signs(tmp_path: Path) -> None:
    (tmp_path / "io16.eds").write_bytes((DEVICES / "io16.eds").read_bytes())
    found = signals_of(tmp_path, "io16.eds")
    rpdos = {name: one for message, all_ in found.items() if "RPDO" in message for name, one in all_.items()}
    assert rpdos["digital_outputs_1_to_8_bit_0"] == (1, False, False)
    assert rpdos["analogue_output_1"] == (16, True, False)
    assert not [name for name in rpdos if name.startswith("object_")]
