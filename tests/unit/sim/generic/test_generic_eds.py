"""A node that is simulated from its device description has what the description has."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from tests.support.foreign import simulated
from tests.support.invented_eds import FIXED, SPIN, U8, U16, U32, Section, described, record, var

FURTHER: Mapping[str, Section] = {
    **SPIN,
    **record(
        "1400",
        "communication",
        var("COB-ID", U32, "rw", "$NODEID+0x200"),
        var("type", U8, "rw", "255"),
        var("inhibit time", U16, "rw", "0"),
        var("reserved", U8, "rw", "0"),
        var("event timer", U16, "rw", "100"),
    ),
}
LONELY: Mapping[str, Section] = {**SPIN, **record("1620", "mapping", var("object", U32, "rw", "0x60400010"))}


@pytest.mark.parametrize(
    "sections",
    [
        pytest.param(SPIN, id="a plain drive"),
        pytest.param(FIXED, id="PDOs that cannot be changed"),
        pytest.param(FURTHER, id="an RPDO with a deadline"),
        pytest.param(LONELY, id="a mapping of no PDO"),
    ],
)
def test_every_object_of_the_description_can_be_read(sections: Mapping[str, Section]) -> None:
    assert simulated(described(sections)) == []
