"""The format of mapping files: several PDOs to a slot, values of all kinds, faults with their lines."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import Family, load_family, read_family
from tests.support.invented import SPIN


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


@pytest.mark.landing(41)
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
