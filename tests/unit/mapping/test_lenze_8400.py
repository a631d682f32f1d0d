"""The 8400 motec family, against the manual's own figures (EDS84DMOTCAN 3.0)."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.mapping import family_names, load_family
from bridge.mapping.loader import mappings_dir
from bridge.mapping.match import Found, best_match
from bridge.mapping.own_places import place_of
from bridge.text import render

NAME = "lenze/8400-motec"
LENZE = load_family(NAME)
(SLOT,) = LENZE.slot
CONTROL = ControlWords(LENZE.control_word)
STATUS = StatusWords(LENZE.status_word)


def test_is_found_by_its_name():
    assert NAME in family_names()


def test_is_one_drive_at_addresses_1_to_63():
    """§7.1.1."""
    assert SLOT.name == "drive"
    assert (LENZE.family.node_id_low, LENZE.family.node_id_high) == (1, 63)


def test_is_recognised_by_its_vendor_id():
    """§13, I-1018."""
    families = {name: load_family(name) for name in ("lenze/8400-motec", "nord/sk-tu4-cao")}
    match = best_match(Found(device_type=0, vendor=0x3B, product=1, revision=1), families)
    assert match is not None
    assert match.mapping == NAME
    assert best_match(Found(device_type=0, vendor=0x3C, product=1, revision=1), families) is None


def test_the_cob_ids_are_the_canopen_base():
    """§7.1.1, §8.3."""
    assert [pdo.cob_id for pdo in SLOT.rpdo] == [0x200, 0x300]
    assert [pdo.cob_id for pdo in SLOT.tpdo] == [0x180, 0x280]
    (second,) = LENZE.sdo
    assert (second.number, second.request, second.reply) == (2, 0x640, 0x5C0)


def test_the_second_pdo_is_optional_and_nothing_is_written():
    for pdos in (SLOT.rpdo, SLOT.tpdo):
        assert [pdo.optional for pdo in pdos] == [False, True]
        assert not any(pdo.write for pdo in pdos)
        assert all(pdo.static for pdo in pdos)


def test_the_supervision_is_the_code_of_rpdo1_and_its_reaction():
    """§10.1, §12.2."""
    own = LENZE.own_supervision[0]
    assert own.reaction is not None
    time, reaction = place_of(LENZE, own), place_of(LENZE, own.reaction)
    assert (str(time.ref), str(reaction.ref)) == ("5E9A:01", "5DAE:01")
    harmless = [reaction.states[value] for value in own.reaction.nothing]
    assert [render(words, "en") for words in harmless] == ["no reaction", "warning locked"]
    assert [render(words, "de") for words in harmless] == ["Keine Reaktion", "Verriegelte Warnung"]
    assert (own.factory, own.reaction.factory) == (3000, 0)


def test_the_error_number_is_in_bytes_4_to_7_of_f000():
    """§10.4."""
    number = LENZE.emcy.number
    assert number is not None
    assert (number.byte, number.size) == (4, 4)
    assert "F000" in number.codes


@pytest.mark.parametrize(
    "code", ["3100", "8100", "8130", "8150", "8210", "8220", "8700", "F000", "1000", "0000"]
)
def test_every_emcy_code_of_the_manual_has_a_text(code):
    """§10.4, §13 I-1003."""
    assert LENZE.emcy.codes[code]


@pytest.mark.parametrize("word", [CONTROL.stopped, CONTROL.ready, 0x000D, 0x000B, 0x0008, 0x000F, 0x0007])
def test_only_switch_on_and_enable_operation_alone_move_the_drive(word):
    assert not CONTROL.enables(word)
    assert CONTROL.enables(CONTROL.run)


@pytest.mark.parametrize("stop", [CONTROL.stop, CONTROL.quick_stop, CONTROL.disable_voltage])
def test_no_stop_enables_by_the_bits_of_cia_402_either(stop):
    """Were a drive wired with those after all, a stop of ours would still be one."""
    word = stop(CONTROL.run)
    assert not CONTROL.enables(word)
    assert word & 0x000F != 0x000F


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x01C2, DriveState.NOT_READY),
        (0x03C2, DriveState.READY),
        (0x04C2, DriveState.SWITCHED_ON),
        (0x0518, DriveState.OPERATION_ENABLED),
        (0x27C2, DriveState.FAULT),
        (0x08C2, DriveState.FAULT),
        (0x0AC2, DriveState.SWITCH_ON_INHIBITED),
        (0x0FC2, DriveState.UNKNOWN),
    ],
)
def test_the_device_state_is_in_bits_8_to_11(word, state):
    assert STATUS.state(word) is state


def test_the_word_that_is_served_while_tripped_is_a_fault():
    assert STATUS.as_fault(0x0518) == 0x0818
    assert STATUS.state(STATUS.as_fault(0x0518)) is DriveState.FAULT


def test_parameters_stay_in_the_drive_only_when_saved():
    """§7.1.2."""
    assert LENZE.eeprom is not None
    assert LENZE.eeprom.written_on_save_only
    assert str(LENZE.object_of(LENZE.parameter_named("C00002/11"))) == "5FFD:0B"


def test_a_small_file_changes_the_words(tmp_path: Path):
    """The example of docs/how-to/use-a-lenze-8400-motec.md."""
    (tmp_path / "plant").mkdir()
    example = Path(__file__).with_name("motec-as-cia402.toml")
    (tmp_path / "plant" / "motec.toml").write_text(example.read_text(encoding="utf-8"), encoding="utf-8")
    family = load_family("plant/motec", (tmp_path, mappings_dir()))
    words = ControlWords(family.control_word)
    assert words.enables(0x000F)
    assert not words.enables(0x0009)
    assert StatusWords(family.status_word).state(0x0237) is DriveState.OPERATION_ENABLED
    assert [value.leaf for value in family.value] == ["command/velocity", "actual/velocity", "actual/current"]
    assert family.slot == LENZE.slot
    assert family.parameter == LENZE.parameter
    assert family.emcy == LENZE.emcy


def test_a_static_mapping_cannot_be_written(tmp_path: Path):
    example = tmp_path / "wrong.toml"
    slots = (
        '[[slot]]\nname = "drive"\nrpdo = {{ number = 1, cob_id = 0x200, static = true, write = true, {0} }}'
    )
    objects = 'words = ["control_word"], objects = [["0000:01"]]'
    example.write_text(f'extends = "lenze/8400-motec"\n{slots.format(objects)}', encoding="utf-8")
    with pytest.raises(FileFaults, match="a static mapping has no objects to write"):
        load_family("wrong", (tmp_path, mappings_dir()))
