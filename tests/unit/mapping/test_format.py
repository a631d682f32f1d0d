"""The format of mapping files: several PDOs to a slot, values of all kinds, names of parameters, files that
extend others; every fault with the file and the line where it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import Family, family_names, load_family, read_family
from bridge.mapping.loader import mapping_folders, mappings_dir
from bridge.mapping.parameters import ParameterNames, object_of
from bridge.mapping.site import load_site_and_families
from tests.support.invented import NAME, SITE, SPIN


def family(folder: Path, text: str = SPIN) -> Family:
    path = folder / "spin.toml"
    path.write_text(text)
    return read_family(path)


def faults(folder: Path, old: str, new: str) -> list[str]:
    assert old in SPIN
    with pytest.raises(FileFaults) as caught:
        family(folder, SPIN.replace(old, new, 1))
    line = SPIN[: SPIN.index(old)].count("\n") + 1
    found = [(fault.line, f"{fault.key}: {fault.message} ({fault.hint})") for fault in caught.value.faults]
    assert any(abs(at - line) <= 3 + new.count("\n") for at, _ in found), (line, found)
    return [text for _, text in found]


def test_a_slot_has_the_words_that_its_pdos_carry(tmp_path: Path) -> None:
    spin = family(tmp_path)
    rpdo, tpdo = spin.carried(spin.slot[0])
    assert rpdo == spin.process.rpdo
    assert tpdo == spin.process.tpdo
    text = SPIN.replace('"modes", "valves"]', '"modes", "valves", "more"]')
    assert "more" not in family(tmp_path, text).carried(spin.slot[0])[0]


def test_one_table_stands_for_a_list_of_one(tmp_path: Path) -> None:
    (slot,) = (one for one in load_family("nord/sk-tu4-cao").slot if one.name == "fu2")
    assert [pdo.number for pdo in slot.rpdo] == [2]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("optional = true", "optional = 1", "slot[0].rpdo[2].optional: must be true or false, not 1"),
        ("event_ms = 100", "event_ms = 100000", "slot[0].tpdo[1].event_ms: must be at most 65535"),
        (
            "write = true\nevent_ms = 100",
            "event_ms = 100",
            "slot[0].tpdo[1].event_ms: has no effect without write = true",
        ),
        (
            'words = ["valves"]',
            'words = ["valve"]',
            "slot[0].rpdo[2].words[0]: process.rpdo has no word 'valve' (known: control_word, speed, ",
        ),
        ('words = ["valves"]', 'words = ["speed"]', "word 'speed' is there twice (first in line"),
        (
            'words = ["valves"]',
            'words = ["valves", "modes"]',
            "slot[0].rpdo[2].objects: has 1 words and words names 2",
        ),
        ("number = 3", "number = 2", "RPDO number '2' is there twice"),
        (
            'words = ["control_word", "speed"]\nobjects = [["6040:00"], ["6042:00"]]',
            'words = ["control_word", "speed"]\nobjects = [["6040:00"], ["6042:00"]]\noptional = true',
            "slot[0].rpdo: none of them carries the control_word (one that is not optional must)",
        ),
        ('"2100:00/8"', '"2100:00/65"', "slot[0].rpdo[2].objects[0][0]: must have 1…64 bits"),
        ('"2100:00/8"', '"2100:00/32"', "2100:00/32 is longer than the words it is named for"),
        ('"2100:00/8"', '"2100:00/8+"', 'must be an object as "3002:01", with its bits as "6060:00/8"'),
        ('"2AC8:00+2830:00"', '"2AC8:00/8+2830:00/16"', "has 24 bits, a word has 16"),
        (
            'words = ["target_low", "target_high", "modes"]',
            'words = ["target_high", "target_low", "modes"]',
            "slot[0].rpdo[1].objects[1]: target_high and target_low share an object and are no neighbours",
        ),
        (
            'type = "int8", value = 3',
            'type = "int8", value = 300',
            "slot[0].start[0].value: a int8 is -128…127",
        ),
        ('type = "int8"', 'type = "int9"', 'slot[0].start[0].type: must be "bool"'),
        (
            'word = "speed_now"',
            'words = ["speed_now"]',
            "value[0].words: must be two words, the low one first",
        ),
        ('word = "speed_now"', "", "value[0]: speed needs one of word, words and code"),
        (
            'words = ["position_low", "position_high"]',
            'words = ["speed_now", "position_high"]',
            "value[2].words: the words of position are in two PDOs of axis (they must be in one)",
        ),
        (
            'words = ["position_low", "position_high"]',
            'words = ["position_low", "position_high"]\ndata_type = "int16"',
            "value[2].data_type: int16 does not fit two words (int32, uint32 or real32)",
        ),
        (
            "scale = { factor = 0.01, offset = -5.0 }",
            "scale = { factor = 0.0 }",
            "value[2].scale.factor: must not be 0",
        ),
        (
            "scale = { factor = 0.01, offset = -5.0 }",
            "scale = { factor = 0.01, at = 3 }",
            "value[2].scale.at: has no meaning without full",
        ),
        ('scale = { full = "P7", at = 1000 }', 'scale = { full = "P7" }', "value[0].scale.at: is missing"),
        (
            'scale = { full = "P7", at = 1000 }',
            'scale = { full = "P7", at = 1, offset = 2.0 }',
            "value[0].scale.offset: has no meaning with full",
        ),
        ("low = -100.0", "low = 2000.0", "value[3].low: is above high, 1000"),
        ("states = { 0 =", "low = 1.0\nstates = { 0 =", "value[4].low: has no meaning with states"),
        ("states = { 0 =", "states = { x =", "must be a number in decimal, such as 3"),
        ("states = { 0 =", "states = { 70000 =", "value[4].states: 70000 is no uint16 (0…65535)"),
        (
            '["left", "right"]',
            '["left", "left"]',
            "value[8].bits[1]: bit 'left' is there twice (first in line",
        ),
        ("bit = 0", "bit = 16", "value[5].bit: must be at most 15, not 16"),
        ("bit = 0", 'bit = 0\nbits = ["a"]', "value[5].bit: valve_a has bits already"),
        ("bit = 0", "bit = 0\nscale = {}", "value[5].bit: valve_a has scale already"),
        (
            'name = "P7"\ntitle = "full speed"',
            'name = "X7"\ntitle = "full speed"',
            "parameter[0].name: 'X7' is no parameter; they are written as P7",
        ),
        (
            "pattern = 'P(?P<number>\\d+)'",
            "pattern = 'P('",
            "parameter_names.pattern: must be a regular expression",
        ),
        ("pattern = 'P(?P<number>\\d+)'", "pattern = 'P(?P<nr>\\d+)'", "must name the groups number, letter"),
        (
            'title = "present fault"',
            'title = "present fault"\nevery_ms = 100',
            "parameter[1].every_ms: has no effect without point = true",
        ),
        (
            'title = "present fault"',
            'title = "present fault"\naccess = "rx"',
            'parameter[1].access: must be "rw", "ro" or "wo", not "rx"',
        ),
        (
            'current = { parameter = "P90" }',
            'current = { parameter = "P9" }',
            "faults.current.parameter: there is no parameter 'P9' (known: P7, P90, P91)",
        ),
        ("byte = 3, cause_byte", "byte = 2, cause_byte", "emcy.event.byte: must be at least 3, not 2"),
        (
            "event = { byte = 3, cause_byte = 4, gone = 30 }",
            "number = { codes = ['F000'], byte = 6, size = 4 }",
            "emcy.number: ends behind the message, which has bytes 0…7",
        ),
        (
            "event = { byte = 3, cause_byte = 4, gone = 30 }\n",
            "",
            "emcy.events: has no meaning without emcy.event or emcy.number",
        ),
        ('"41" =', '"4x" =', 'must be a number in decimal, such as "41"'),
    ],
)
def test_a_fault_is_told_with_its_line(tmp_path: Path, old: str, new: str, fault: str) -> None:
    found = faults(tmp_path, old, new)
    assert any(fault in text for text in found), found


def test_eeprom_and_its_parameter(tmp_path: Path) -> None:
    wear = '[eeprom]\ncycles = 1000\nram_only = { parameter = "P7", value = 0 }\nsave = "1010:01"\n[emcy]'
    spin = family(tmp_path, SPIN.replace("[emcy]", wear, 1))
    assert spin.eeprom is not None
    assert str(spin.eeprom.save) == "1010:01"
    with pytest.raises(FileFaults, match="there is no parameter 'P8'"):
        family(tmp_path, SPIN.replace("[emcy]", wear.replace("P7", "P8"), 1))


NAMES = {
    "nord": {
        "pattern": r"P(?P<number>\d{1,3})(\[(?P<element>\d+)\])?(\.(?P<set>[1-4]))?",
        "example": "P102",
        "index": 0x2000,
        "element_step": 4,
        "element_first": 1,
        "set_step": 1,
    },
    "lenze": {
        "pattern": r"C(?P<number>\d{5})(/(?P<element>\d+))?",
        "example": "C00039/1",
        "index": 0x5FFF,
        "number_step": -1,
        "element_step": 1,
    },
    "stoeber": {
        "pattern": r"(?P<letter>[A-Z])(?P<number>\d{2,3})(\.(?P<element>\d+))?",
        "example": "E08",
        "index": 0x2000,
        "letter_step": 0x200,
        "element_step": 1,
    },
}


@pytest.mark.parametrize(
    ("names", "name", "sets", "elements", "object_"),
    [
        # BU 2500 §6.6.1: 2000h + number, sub-index 4·(element − 1) + parameter set.
        ("nord", "P102", 4, 0, "2066:01"),
        ("nord", "P102.3", 4, 0, "2066:03"),
        ("nord", "P509", 0, 0, "21FD:00"),
        ("nord", "P543[2].3", 4, 5, "221F:07"),
        # EDS84DMOTCAN 3.0 §9.2: 24575 − code, sub-index = sub-code.
        ("lenze", "C00061", 0, 0, "5FC2:00"),
        ("lenze", "C00039/1", 0, 0, "5FD8:01"),
        # ID 441684.06 §11.2: 2000h + 200h·letter + line.
        ("stoeber", "E08", 0, 0, "2808:00"),
        ("stoeber", "A180", 0, 0, "20B4:00"),
        ("stoeber", "C01", 0, 0, "2401:00"),
    ],
)
def test_names_of_parameters_are_objects(
    names: str, name: str, sets: int, elements: int, object_: str
) -> None:
    assert str(object_of(ParameterNames.model_validate(NAMES[names]), name, sets, elements)) == object_


@pytest.mark.parametrize(
    ("name", "sets", "elements", "message"),
    [
        ("C5", 0, 0, "'C5' is no parameter; they are written as P102"),
        ("P102.3", 2, 0, "'P102.3': its parameter sets are 1…2"),
        ("P102[3]", 0, 2, r"'P102\[3\]': its elements are 1…2"),
        ("P102[99]", 0, 0, "there cannot be"),
    ],
)
def test_a_name_that_is_none(name: str, sets: int, elements: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        object_of(ParameterNames.model_validate(NAMES["nord"]), name, sets, elements)


BASE = SPIN.replace('source = "nobody\'s manual"', 'source = "nobody\'s manual"\ntemplate = true', 1)
VARIANT = """\
extends = "acme/base"
[family]
name = "Spin 4000"
[[value]]
name = "speed"
group = "actual"
unit = "Hz"
[[value]]
name = "temperature"
group = "actual"
word = "modes_now"
unit = "°C"
[[parameter]]
name = "P90"
title = "fault now"
[faults.texts]
"9.9" = "new"
"""


class Folder:
    """A site's own folder of mappings."""

    def __init__(self, at: Path) -> None:
        self.top = at
        self.site = at / "site.toml"
        self.site.write_text(SITE.format(drive="", node=""))

    def add(self, name: str, text: str) -> Path:
        path = self.top / "mappings" / f"{name}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def load(self, name: str) -> Family:
        return load_family(name, mapping_folders(self.site))

    def told(self, name: str) -> list[str]:
        with pytest.raises(FileFaults) as caught:
            self.load(name)
        return [str(fault).removeprefix(f"{self.top}/mappings/") for fault in caught.value.faults]


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    folder = Folder(tmp_path)
    folder.add("acme/base", BASE)
    return folder


class TestExtends:
    def test_tables_are_merged_and_named_items_too(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT)
        spin = folder.load("acme/4000")
        assert (spin.family.name, spin.family.vendor, spin.family.template) == ("Spin 4000", "Acme", False)
        speed = next(value for value in spin.value if value.leaf == "actual/speed")
        assert (speed.unit, speed.full) == ("Hz", "P7")
        assert spin.value[-1].name == "temperature"
        assert spin.parameter_named("P90").title == "fault now"
        assert spin.parameter_named("P90").factor == 0.1
        assert spin.faults.texts == {"1.0": "controller silent", "7.2": "spindle too hot", "9.9": "new"}

    def test_a_value_of_the_other_group_is_another_one(self, folder: Folder) -> None:
        more = '[[value]]\nname = "speed"\ngroup = "command"\nword = "modes"\n'
        text = (
            SPIN.replace('"speed", "target_low"', '"speed_set", "target_low"')
            .replace('["control_word", "speed"]', '["control_word", "speed_set"]')
            .replace('word = "speed"\n', 'word = "speed_set"\n')
        )
        folder.add("acme/base", text)
        folder.add("acme/4000", f'extends = "acme/base"\n{more}')
        assert {value.leaf for value in folder.load("acme/4000").value} >= {"actual/speed", "command/speed"}

    def test_other_lists_are_replaced(self, folder: Folder) -> None:
        folder.add("acme/4000", 'extends = "acme/base"\n[control_word]\nbits = ["one"]\n')
        assert folder.load("acme/4000").control_word.bits == ["one"]

    def test_a_slot_gets_other_pdos(self, folder: Folder) -> None:
        pdo = '[slot.rpdo]\nnumber = 4\ncob_id = 0x500\nwords = ["control_word"]\nobjects = [["6040:00"]]\n'
        folder.add("acme/4000", f'extends = "acme/base"\n[[slot]]\nname = "axis"\n{pdo}')
        spin = folder.load("acme/4000")
        assert [one.number for one in spin.slot[0].rpdo] == [4]
        assert len(spin.slot[0].tpdo) == 3
        assert [value.name for value in spin.values_of(spin.slot[0]) if value.group == "command"] == []

    def test_one_setting_of_a_pdo_is_changed_by_its_number(self, folder: Folder) -> None:
        head = 'extends = "acme/base"\n[[slot]]\nname = "axis"\n'
        folder.add("acme/4000", f"{head}[[slot.tpdo]]\nnumber = 2\nevent_ms = 20\n")
        slot = folder.load("acme/4000").slot[0]
        assert [one.number for one in slot.tpdo] == [1, 2, 3]
        assert (slot.tpdo[1].event_ms, slot.tpdo[1].cob_id, slot.tpdo[1].write) == (20, 0x280, True)
        folder.add("acme/4000", f"{head}[slot.rpdo]\ncob_id = 0x220\n")
        slot = folder.load("acme/4000").slot[0]
        assert [(one.number, one.cob_id) for one in slot.rpdo] == [(1, 0x220), (2, 0x300), (3, 0x400)]

    def test_a_fault_in_a_pdo_that_is_changed_has_its_line(self, folder: Folder) -> None:
        text = 'extends = "acme/base"\n[[slot]]\nname = "axis"\n[[slot.tpdo]]\nnumber = 2\nevent_ms = -1\n'
        folder.add("acme/4000", text)
        assert folder.told("acme/4000")[0].startswith("acme/4000.toml:6: slot[0].tpdo[0].event_ms: must be")

    def test_a_single_pdo_and_a_list_are_one(self, folder: Folder) -> None:
        head = 'extends = "cia402/velocity"\n[[slot]]\nname = "drive"\n'
        base = f"{head}[[slot.tpdo]]\nnumber = 1\nevent_ms = 50\n"
        folder.add("acme/fan", base)
        (pdo,) = folder.load("acme/fan").slot[0].tpdo
        assert (pdo.event_ms, pdo.cob_id, pdo.inhibit_ms) == (50, 0x180, 10.0)
        folder.add("acme/fan", base.replace("[[slot.tpdo]]\nnumber = 1", "[slot.tpdo]"))
        assert folder.load("acme/fan").slot[0].tpdo == [pdo]

    def test_what_a_variant_has_not_is_left_out(self, folder: Folder) -> None:
        without = '["value:command/valve_b", "value:actual/probes", "parameter:P90"]'
        more = '[[value]]\nname = "in_position"\ngroup = "actual"\nbit = 99\n'
        folder.add("acme/base", BASE.replace('current = { parameter = "P90" }\n', ""))
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n')
        spin = folder.load("acme/4000")
        leaves = {value.leaf for value in spin.value}
        assert "command/valve_a" in leaves
        assert leaves.isdisjoint({"command/valve_b", "actual/probes"})
        assert [one.name for one in spin.parameter] == ["P7", "P91"]
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n{more}')
        assert folder.told("acme/4000")[0].startswith("acme/4000.toml:6: value[0].bit: must be")
        folder.add("acme/5000", 'extends = "acme/4000"\nwithout = []\n')
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n')
        assert [one.name for one in folder.load("acme/5000").parameter] == ["P7", "P91"]

    def test_what_is_left_out_must_be_there(self, folder: Folder) -> None:
        folder.add("acme/4000", 'extends = "acme/base"\nwithout = ["parameter:P5", "pdo:2"]\n')
        first, second = folder.told("acme/4000")
        assert "acme/4000.toml:2: without[0]: there is no 'parameter:P5'" in first
        assert "known: P7, P90, P91" in first
        assert "it is one of value, meaning, parameter, poll, slot, input, own_supervision" in second
        folder.add("acme/4000", 'extends = "acme/base"\nwithout = ["parameter:P7"]\n')
        assert "there is no parameter 'P7'" in folder.told("acme/4000")[0]

    def test_a_fault_is_told_with_the_file_where_it_stands(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT.replace('word = "modes_now"', 'word = "modes_then"'))
        assert folder.told("acme/4000")[0].startswith(
            "acme/4000.toml:11: value[1].word: there is no value word 'modes_then'"
        )
        folder.add("acme/4000", VARIANT)
        folder.add("acme/base", BASE.replace('word = "speed_now"', 'word = "speed_then"'))
        line = BASE[: BASE.index('word = "speed_now"')].count("\n") + 1
        assert folder.told("acme/4000")[0].startswith(
            f"acme/base.toml:{line}: value[0].word: there is no value word 'speed_then'"
        )

    def test_what_is_missing_is_missing_in_the_file_that_extends(self, folder: Folder) -> None:
        folder.add("acme/base", BASE.replace('vendor = "Acme"\n', ""))
        folder.add("acme/4000", VARIANT)
        assert folder.told("acme/4000")[0] == "acme/4000.toml:2: family.vendor: is missing"

    def test_three_files_in_a_row(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT)
        folder.add("acme/5000", 'extends = "acme/4000"\n[family]\nname = "Spin 5000"\n')
        spin = folder.load("acme/5000")
        assert (spin.family.name, spin.value[-1].name) == ("Spin 5000", "temperature")

    def test_a_circle_is_told(self, folder: Folder) -> None:
        folder.add("acme/a", 'extends = "acme/b"\n')
        folder.add("acme/b", 'extends = "acme/a"\n')
        assert "extends: 'acme/a' extends this file in its turn" in folder.told("acme/a")[0]
        folder.add("acme/c", 'extends = "acme/c"\n')
        assert "acme/c.toml:1: extends: extends itself" in folder.told("acme/c")[0]

    def test_one_that_is_not_there_is_told_with_what_is(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT.replace("acme/base", "acme/bass"))
        (told,) = folder.told("acme/4000")
        assert told.startswith(
            "acme/4000.toml:1: extends: there is no mapping 'acme/bass' (there are: acme/4000"
        )
        assert "acme/base" in told

    def test_twice_in_one_file_is_twice(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT + '[[parameter]]\nname = "P90"\n')
        told = folder.told("acme/4000")
        assert any("parameter[1]" in line for line in told)

    def test_a_file_of_the_site_may_extend_the_one_that_comes_with_the_program(self, folder: Folder) -> None:
        name = "nord/sk-tu4-cao"
        folder.add(name, f'extends = "{name}"\n[family]\nnode_id_high = 9\n')
        assert folder.load(name).family.node_id_high == 9
        assert load_family(name).family.node_id_high == 63

    def test_a_template_is_for_no_site(self, folder: Folder) -> None:
        folder.add(NAME, BASE)
        assert NAME not in family_names(mapping_folders(folder.site))
        with pytest.raises(FileFaults) as caught:
            load_site_and_families(folder.site)
        (fault,) = caught.value.faults
        assert (fault.line, fault.key) == (9, "bus[0].node[0].mapping")
        assert fault.message == "'acme/spin' is a template: it can only be extended"


class TestOwnFolder:
    def test_the_folder_beside_the_site_file_comes_first(self, folder: Folder) -> None:
        folder.add(NAME, SPIN)
        _, families = load_site_and_families(folder.site)
        assert families[NAME].family.name == "Spin 3000"
        assert mapping_folders(folder.site) == (folder.top / "mappings", mappings_dir())
        assert "nord/sk-tu4-cao" in family_names(mapping_folders(folder.site))

    def test_its_faults_come_with_those_of_the_site(self, folder: Folder) -> None:
        path = folder.add(NAME, SPIN.replace("acknowledge_bit = 7", "acknowledge_bit = 77"))
        with pytest.raises(FileFaults) as caught:
            load_site_and_families(folder.site)
        (fault,) = caught.value.faults
        assert (fault.file, fault.key) == (str(path), "control_word.acknowledge_bit")


@pytest.mark.parametrize(
    ("drive", "fault"),
    [
        ("rpdo = { number = 7 }", "rpdo.number: axis of Spin 3000 has no RPDO7 (it has 1, 2, 3)"),
        ("tpdo = [{ number = 2 }, { number = 2 }]", "tpdo[1].number: there are two tables for TPDO2"),
        ("tpdo = [{ number = 1 }, { enable = true }]", "tpdo[1].number: there are two tables for TPDO1"),
    ],
)
def test_a_pdo_of_the_site_file_is_one_that_the_drive_has(folder: Folder, drive: str, fault: str) -> None:
    folder.add(NAME, SPIN)
    folder.site.write_text(SITE.format(drive=drive, node=""))
    with pytest.raises(FileFaults, match=r"site\.toml:14: bus\[0\]") as caught:
        load_site_and_families(folder.site)
    assert fault in str(caught.value)
