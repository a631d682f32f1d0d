"""Parameters that scale a drive's words or say what they carry: which are asked for, what answers mean."""

from __future__ import annotations

import math
import struct

import pytest

from bridge.canopen.sdo import SdoError
from bridge.mapping.model import Parameter
from bridge.node.boot.actions import BootResult
from bridge.node.boot.scales import code_of, deciding_of, meanings_of, parameter_value, read_words
from bridge.text import render
from tests.support import sites
from tests.support.answering import Answering
from tests.support.nodes import node_of


def parameter(**more: object) -> Parameter:
    keys = {"name": "P105", "title": "maximum frequency", "data_type": "int16"}
    return Parameter.model_validate({**keys, **more})


@pytest.mark.parametrize(
    ("kind", "factor", "data", "value"),
    [
        ("int16", 0.1, "F401", 50.0),
        ("int16", 0.1, "FEFF", -0.2),
        ("uint16", 1.0, "FEFF", 65534),
        ("uint32", 0.001, "E8030000", 1.0),
        ("real32", 1.0, "0000C03F", 1.5),
    ],
)
def test_a_value_is_the_number_times_its_factor(kind: str, factor: float, data: str, value: float) -> None:
    one = parameter(data_type=kind, factor=factor)
    assert parameter_value(one, bytes.fromhex(data)) == value


def test_what_is_no_number_is_named() -> None:
    with pytest.raises(ValueError, match="P105 is a string, no number"):
        parameter_value(parameter(data_type="string"), b"50")
    with pytest.raises(ValueError, match="P105 is a real32: 2 bytes are too few"):
        parameter_value(parameter(data_type="real32"), b"\1\0")


def test_a_nord_drive_is_asked_in_each_of_its_four_sets() -> None:
    """BU 2500 §6.5.4: P543 and P546 say what the words carry, in parameter sets 1 … 4."""
    (drive,) = node_of().drives
    asked = meanings_of(drive)
    assert {in_set for _, in_set, _ in asked} == {1, 2, 3, 4}
    assert len({ref for _, _, ref in asked}) == len(asked), "each from a place of its own"


def test_a_code_that_the_drive_refuses_is_the_one_for_absent() -> None:
    (drive,) = node_of().drives
    meaning = meanings_of(drive)[0][0]
    assert code_of(drive.family, meaning, None) == meaning.absent
    assert code_of(drive.family, meaning, b"\1\0") == 1


def answers(drive_slot: str = "fu1") -> tuple[Answering, BootResult]:
    """A drive that has factory codes, and 50 Hz in each of its sets."""
    (drive,) = node_of(sites.drive(drive_slot, "lease", 200, "")).drives
    node = Answering({(ref.index, ref.sub): b"\1\0" for _, _, ref in meanings_of(drive)})
    return node, BootResult()


def test_what_is_read_is_found_by_name_and_set() -> None:
    node, result = answers()
    of_node = node_of()
    (drive,) = of_node.drives
    found = node.run(read_words(of_node, drive, result))
    assert all(code == 1 for codes in found.codes.values() for code in codes)
    asked = deciding_of(drive, found.codes)
    assert {(one.name, in_set) for one, in_set, _ in asked} == set(found.parameters)
    assert all(value is None for value in found.parameters.values()), "the node has refused them all"


def test_what_is_not_answered_is_no_value_and_is_noted() -> None:
    node, result = answers()
    of_node = node_of()
    (drive,) = of_node.drives
    codes = {one.leaf: [1] * drive.family.sets for one, _, _ in meanings_of(drive)}
    one, in_set, ref = deciding_of(drive, codes)[0]
    node.silent = {(ref.index, ref.sub)}
    silence = SdoError(ref.index, ref.sub, 0x0504_0000, by_server=False)
    found = node.run(read_words(of_node, drive, result))
    value = found.parameters[one.name, in_set]
    assert value is not None
    assert math.isnan(value)
    assert render(result.notes[0]) == f"cannot be read, and is not needed: {silence}"


def test_the_drives_own_value_counts_beside_that_of_the_site_file() -> None:
    of_node = node_of(sites.drive("fu1", "lease", 200, "parameters = { P105 = 60.0 }"))
    (drive,) = of_node.drives
    codes = {one.leaf: [1] * drive.family.sets for one, _, _ in meanings_of(drive)}
    node, result = answers()
    for one, _, ref in deciding_of(drive, codes):
        raw = round(50 / one.factor)
        node.objects[ref.index, ref.sub] = struct.pack("<h", raw)
    node.run(read_words(of_node, drive, result))
    assert "fu1: P105 is 50 Hz in the drive, 60 in the site file; the drive's counts" in map(
        render, result.notes
    )


def test_without_a_channel_nothing_is_asked_and_the_key_is_named() -> None:
    of_node = node_of(sites.drive("fu3", "lease", 200, ""))
    (drive,) = of_node.drives
    node = Answering()
    found = node.run(read_words(of_node, drive, BootResult()))
    assert node.reads == []
    assert render(found.why_unread) == "cannot be read: no SDO channel reaches this drive (sdo_channels)"
