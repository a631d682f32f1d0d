"""Mapping files: every fault with its line, and what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import family_names, load_family, read_family
from bridge.mapping.loader import mappings_dir
from bridge.mapping.model import pattern_bits
from bridge.mapping.site_families import load_site_and_families
from tests.support.sample_family import FAMILY, told


def test_the_sample_is_a_family(tmp_path: Path):
    path = tmp_path / "family.toml"
    path.write_text(FAMILY)
    assert read_family(path).family.name == "Test"


@pytest.mark.landing(37)
@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            '"0XX1000"',
            '"0XX1002"',
            "48: status_word.state[1].pattern: must be written with 0, 1 and X (do not care), highest bit "
            'first, not "0XX1002"',
        ),
        ('"0XX1000"', '"' + "0" * 17 + '"', "48: status_word.state[1].pattern: must be written"),
        ('"60FD:00"', '"60FD"', '31: poll[0].object: must be an object as "3002:01", index and sub-index'),
        ('["6042:00"]]', '["6042:0"]]', '13: slot[0].rpdo.objects[1][0]: must be an object as "3002:01"'),
        ('["6042:00"]]', "[]]", "13: slot[0].rpdo.objects[1]: must have 1 or more entries"),
        ('["6042:00"]]', "7]", "13: slot[0].rpdo.objects[1]: must be a list, not 7"),
        (', ["6042:00"]]', "]", "13: slot[0].rpdo.objects: has 1 words and process.rpdo names 2"),
        ("cob_id = 0x180", "cob_id = 0x7FF", "16: slot[0].tpdo.cob_id: 7FFh leaves no room for the node id"),
        ('full = "P1"', 'full = "P2"', "22: value[0].scale.full: there is no parameter 'P2' (known: P1)"),
        (
            'word = "setpoint_1"',
            'word = "setpoint_9"',
            "21: value[0].word: there is no value word 'setpoint_9'",
        ),
        ('word = "setpoint_1"', 'word = "control_word"', "21: value[0].word: there is no value word"),
        (
            'name = "velocity"',
            'name = "setpoint_1"',
            "19: value[0].name: point 'command/setpoint_1' is there",
        ),
        ('name = "velocity"', 'name = "Speed!"', "19: value[0].name: must be lower_snake_case"),
        ("at = 1000", "at = 0", "22: value[0].scale.at: must be more than 0, not 0"),
        ('"control_word", "setpoint_1"', '"setpoint_1", "control_word"', "6: process.rpdo: must begin with"),
        ('"status_word", "value_1"', '"value_1", "status_word"', "7: process.tpdo: must begin with"),
        (
            'rpdo = ["control_word", "setpoint_1"]',
            "rpdo = []",
            "6: process.rpdo: must have 1 or more entries",
        ),
        ('name = "one"', 'name = "FU 1"', "9: slot[0].name: must be lower_snake_case"),
        ("[slot.tpdo]", "emcy_drive = 0\n[slot.tpdo]", "14: slot[0].rpdo.emcy_drive: is not a key"),
        ('name = "inputs"', 'name = "nmt_state"', "30: poll[0].name: every node has 'nmt_state' of its own"),
        (
            'object = "2001:00"\ndata_type = "uint16"',
            'object = "2001:00"\ndata_type = "float"',
            '28: parameter[0].data_type: must be "bool", "int8", "int16", "int32", "int64", "uint8", '
            '"uint16", "uint32", "uint64", "real32", "real64", "string" or "bytes", not "float"',
        ),
        (
            'object = "2001:00"\ndata_type = "uint16"',
            'object = "2001:00"\ndata_type = "unt16"',
            '28: parameter[0].data_type: must be "bool", "int8", "int16", "int32", "int64", "uint8", '
            '"uint16", "uint32", "uint64", "real32", "real64", "string" or "bytes", not "unt16" '
            '(did you mean "uint16"?)',
        ),
        ("stopped = 0", "stopped = 15", "38: control_word.stopped: 000Fh would enable the drive"),
        ("ready = 6", "ready = 0x86", "39: control_word.ready: 0086h acknowledges: bit 7 is 1"),
        ("run = 15", "run = 7", "40: control_word.run: 0007h does not enable the drive"),
        (
            "acknowledge_bit = 7",
            "acknowledge_bit = 16",
            "36: control_word.acknowledge_bit: must be at most 15",
        ),
        (
            "stop = { mask = 1, value = 0 }",
            "stop = { mask = 16, value = 0 }",
            "41: control_word.stop: leaves the drive enabled",
        ),
        (
            "stop = { mask = 1, value = 0 }",
            "stop = { mask = 1, value = 2 }",
            "41: control_word.stop: value has bits outside its mask",
        ),
        ("run = 15", "run = 15\nforward = 1", "41: control_word.forward: has bits of enabling"),
        ('"fault"', '"falt"', '48: status_word.state[1].name: must be "not_ready", '),
        ('"fault"', '"not_ready"', '46: status_word.state: needs a state named "fault"'),
        (
            '"01X0001"',
            '"XXX10XX"',
            "47: status_word.state[0].pattern: ready takes words that are a fault too",
        ),
        (
            '"operation_enabled"',
            '"switched_on"',
            '46: status_word.state: needs a state named "operation_enabled"',
        ),
        (
            '"01X0001"',
            '"01X0XX1"',
            "48: status_word.state[2].pattern: operation_enabled is never told: ready takes all its words",
        ),
        ("0000 = ", "000 = ", "51: emcy.codes.000"),
        ('"1.0" = "silent"', '"1" = "silent"', "58: faults.texts.1"),
        ('vendor = "Nobody"\n', "", "1: family.vendor: is missing"),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path: Path, old: str, new: str, fault: str):
    assert old in FAMILY
    found = told(tmp_path, FAMILY.replace(old, new, 1))
    assert [line for line in found if line.startswith(fault)], found


def test_several_faults_come_in_one_run(tmp_path: Path):
    text = FAMILY.replace("cob_id = 0x200", "cob_id = 0x900").replace("at = 1000", "at = -1")
    text = text.replace("every_ms = 500", "every_ms = 5").replace('"60FD:00"', '"inputs"')
    assert len(told(tmp_path, text)) == 4


@pytest.mark.parametrize("name", ["nord/nothing", "../mappings/nord/sk-tu4-cao", "/etc/passwd", ""])
def test_a_family_is_one_of_those_below_mappings(name: str):
    with pytest.raises(FileFaults, match=r"there is no mapping .* \(there are: .*nord/sk-tu4-cao"):
        load_family(name)


def test_a_pattern_is_a_mask_and_a_value():
    assert pattern_bits("0XX1000") == (0b1001111, 0b0001000)
    assert pattern_bits("1") == (1, 1)
    assert pattern_bits("X") == (0, 0)


def test_every_family_that_is_delivered_loads():
    names = family_names([mappings_dir()])
    assert names
    for name in names:
        load_family(name)


SITE = """\
[site]
name = "hall"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 100
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu9"
[[bus.node.drive]]
slot = "fu2"
parameters = { P105 = 50.0, P106 = 1.0 }
[[bus.node]]
name = "pump"
id = 6
mapping = "nord/sk-tu4-coa"
hold_ms = "long"
[[bus.node.drive]]
slot = "fu1"
"""


class TestSiteAndMappings:
    def test_all_faults_of_a_site_and_its_mappings_come_in_one_run(self, tmp_path: Path):
        path = tmp_path / "site.toml"
        path.write_text(SITE)
        with pytest.raises(FileFaults) as caught:
            load_site_and_families(path)
        assert [str(fault).removeprefix(f"{path}:") for fault in caught.value.faults] == [
            "8: bus[0].node[0].id: SK TU4-CAO has addresses 1…63, not 100",
            "11: bus[0].node[0].drive[0].slot: SK TU4-CAO has no slot 'fu9' (it has fu1, fu2, fu3, fu4)",
            "14: bus[0].node[0].drive[1].parameters.P106: SK TU4-CAO does not scale with 'P106' "
            "(it scales with P105, P112)",
            "18: bus[0].node[1].mapping: there is no mapping 'nord/sk-tu4-coa' "
            '(did you mean "nord/sk-tu4-cao"?)',
            '19: bus[0].node[1].hold_ms: must be a whole number, not "long"',
        ]

    def test_a_site_that_fits_comes_with_its_families(self, tmp_path: Path):
        path = tmp_path / "site.toml"
        text = SITE.replace("100", "5").replace("fu9", "fu1").replace(", P106 = 1.0", "")
        path.write_text(text.replace("coa", "cao").replace('"long"', "1000"))
        site, families = load_site_and_families(path)
        assert [node.name for node in site.bus[0].node] == ["conveyor", "pump"]
        assert list(families) == ["nord/sk-tu4-cao"]


def test_a_file_that_is_nested_too_deeply_is_a_fault(tmp_path: Path):
    """It counts among the names; to use it is a fault with the file's name."""
    (tmp_path / "deep.toml").write_text(f"a = {'[' * 5000}", encoding="utf-8")
    assert family_names((tmp_path,)) == ["deep"]
    with pytest.raises(FileFaults, match=r"deep\.toml.*nested too deeply"):
        load_family("deep", (tmp_path,))
