"""Result of ``family new`` for a device that is no drive."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.derive import derive_family
from bridge.derive.device_family import GENERIC
from bridge.mapping import Family
from tests.support.devices import description_of
from tests.support.invented_eds import family_of


def family(folder: Path, file: str) -> Family:
    made = derive_family(description_of(file), file)
    assert made.base == GENERIC
    assert not made.is_drive
    return family_of(folder, made)


def test_what_tpdos_carry_are_inputs_once(tmp_path: Path) -> None:
    shaft = family(tmp_path, "encoder.eds")
    assert [(one.name, str(one.object), one.data_type) for one in shaft.input] == [
        ("position_value", "6004:00", "uint32"),
        ("speed_value_channel_1", "6030:01", "int16"),
        ("alarms", "6503:00", "uint16"),
        ("warnings", "6505:00", "uint16"),
    ]
    assert not shaft.output


def test_what_rpdos_carry_are_outputs_with_what_they_become_by_themselves(tmp_path: Path) -> None:
    block = family(tmp_path, "io16.eds")
    assert [(one.name, str(one.object), one.data_type) for one in block.output] == [
        ("digital_outputs_1_to_8", "6200:01", "uint8"),
        ("digital_outputs_9_to_16", "6200:02", "uint8"),
        ("analogue_output_1", "6411:01", "int16"),
        ("analogue_output_2", "6411:02", "int16"),
    ]
    assert [(str(one.error_mode), str(one.error_value)) for one in block.output[1:3]] == [
        ("6206:02", "6207:02"),
        ("6443:01", "6444:01"),
    ]
    assert {one.on_expiry for one in block.output} == {0}


@pytest.mark.parametrize("kind", ["input", "output"])
def test_eight_to_an_element_have_names(tmp_path: Path, kind: str) -> None:
    block = family(tmp_path, "io16.eds")
    signals = block.input if kind == "input" else block.output
    assert [len(one.bits) for one in signals] == [8, 8, 0, 0]


def test_what_pdos_carry_is_no_parameter(tmp_path: Path) -> None:
    names = {one.name for one in family(tmp_path, "io16.eds").parameter}
    assert names >= {"6206:01", "6444:02"}
    assert not {"6000:01", "6200:01", "6411:02"} & names
