"""Settings of a device description: those that can be read and written, and the factory's values of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.mapping.model import ObjectRef
from bridge.parameter import Names
from bridge.parameter.factory import described, factory
from tests.support import sites
from tests.support.invented_eds import U8, U16, U32, eds, var

NAMES = Names(sites.family("cia402/velocity"))
SECTIONS = {
    "1017": var("heartbeat", U16, "rw", "100"),
    "1010": var("store", U32, "rw", "1"),
    "2000": var("own", U16, "rw", "$NODEID+7"),
    "2001": var("read", U16, "ro", "7"),
    "2002": var("write", U16, "wo", "7"),
    "2003": var("none", U16, "rw"),
    "2004": var("refuses", U16, "rw", "7", ObjFlags="1"),
    "6040": var("controlword", U16, "rw", "0"),
    "6060": var("modes", U8, "rw", "3"),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "x.eds"
    path.write_bytes(eds(SECTIONS))
    return path


def test_what_is_described_can_be_read_and_written_and_commands_nothing(file: Path) -> None:
    found = described(file, NAMES)
    assert ObjectRef(0x2000, 0) in found
    for index in (0x1017, 0x1010, 0x2001, 0x2002, 0x2004, 0x6040):
        assert ObjectRef(index, 0) not in found, f"{index:04X}h"


def test_the_factory_has_a_value_where_the_file_has_one(file: Path) -> None:
    found = factory(file, NAMES, 5)
    assert found["2000:00"] == 12
    assert "2003:00" not in found
    assert not any(name.startswith(("1017", "6040")) for name in found)


def test_a_value_that_does_not_fit_its_type_is_not_known(tmp_path: Path) -> None:
    path = tmp_path / "x.eds"
    path.write_bytes(eds({"2000": var("own", U8, "rw", "300"), "2001": var("fine", U8, "rw", "3")}))
    assert factory(path, NAMES, 5) == {"2001:00": 3}
