"""The STÖBER 5000 families, against the manual's own figures (ID 441684.06)."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.emcy import decode
from bridge.drive import ControlWords, DriveState
from bridge.mapping import family_names, load_family
from bridge.mapping.loader import mapping_folders
from bridge.mapping.model import pattern_bits
from bridge.mapping.parameters import object_of
from bridge.sim.stoeber.stoeber_events import CODES

ONE = load_family("stoeber/5000")
FOUR = load_family("stoeber/5000-four-axes")
POSI = load_family("stoeber/5000-posi")


def test_are_found_by_their_names():
    assert {"stoeber/5000", "stoeber/5000-four-axes"} <= set(family_names())


def test_the_identity_says_stoeber_and_not_how_strong():
    """§11.1: the product code is the rated power."""
    assert (ONE.identity.device_type, ONE.identity.vendor_id) == (0x20192, 0xB9)
    assert (ONE.identity.product_code, ONE.identity.revision) == (None, None)


def test_four_axes_have_channels_of_their_own():
    """§7.2, §8.2.1; with SDO2 … SDO4 there are addresses up to 31."""
    assert [slot.name for slot in FOUR.slot] == ["axis1", "axis2", "axis3", "axis4"]
    rpdos = [(pdo.number, pdo.cob_id) for slot in FOUR.slot for pdo in slot.rpdo]
    tpdos = [(pdo.number, pdo.cob_id) for slot in FOUR.slot for pdo in slot.tpdo]
    assert rpdos == [(1, 0x200), (2, 0x300), (3, 0x400), (4, 0x500)]
    assert tpdos == [(1, 0x180), (2, 0x280), (3, 0x380), (4, 0x480)]
    assert [(sdo.number, sdo.request, sdo.reply, sdo.slot) for sdo in FOUR.sdo] == [
        (2, 0x620, 0x5A0, "axis2"),
        (3, 0x640, 0x5C0, "axis3"),
        (4, 0x660, 0x5E0, "axis4"),
    ]
    assert all(sdo.after_stop for sdo in FOUR.sdo)
    assert (ONE.family.node_id_high, FOUR.family.node_id_high) == (127, 31)
    ids = [sdo.reply + FOUR.family.node_id_high for sdo in FOUR.sdo]
    assert ids == [0x5BF, 0x5DF, 0x5FF], "none runs into the next"


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("C01", "2401:00"),
        ("E08", "2808:00"),
        ("A180", "20B4:00"),
        ("A225.5", "20E1:05"),
        ("B00", "2200:00"),
        ("I10", "300A:00"),
        ("Z00", "5200:00"),
    ],
)
def test_names_become_objects(name: str, place: str):
    """§11.2 and the examples of §8."""
    assert ONE.parameter_names is not None
    assert str(object_of(ONE.parameter_names, name)) == place


@pytest.mark.parametrize("name", ["c01", "2.C230", "C", "C01.", "P1234", ""])
def test_other_names_are_none(name: str):
    assert ONE.parameter_names is not None
    with pytest.raises(ValueError, match="C01, E08, A225"):
        object_of(ONE.parameter_names, name)


def test_command_positioning_fills_a_pdo():
    """§8.1.1: at most eight bytes, six objects; §10: RPDO1 and TPDO1 have eight."""
    (slot,) = POSI.slot
    rpdo, ramps = slot.rpdo
    (tpdo,) = slot.tpdo
    assert (rpdo.cob_id, ramps.cob_id, tpdo.cob_id) == (0x200, 0x300, 0x180)
    assert [len(pdo.objects) for pdo in (rpdo, ramps, tpdo)] == [4, 2, 4]
    assert ramps.optional
    assert POSI.parameter_names is not None
    named = {"A180": "20B4:00", "I213": "30D5:00", "I216": "30D8:00", "I217": "30D9:00", "I80": "3050:00"}
    for name, place in named.items():
        assert str(object_of(POSI.parameter_names, name)) == place, "§11.2"


def test_no_number_of_a_command_stops_or_enables():
    words = ControlWords(POSI.control_word)
    for high in range(0x20):
        assert words.enables(high << 8 | 0x01)
        assert not words.enables(high << 8)
        assert not words.enables(words.stop(high << 8 | 0x01))


def test_states_come_from_e48_whatever_e200_says():
    """§11.1, 1002h: 0 … 7."""
    names = [state.name for state in ONE.status_word.state]
    assert len(names) == len(set(names)) == 8
    for number, state in enumerate(ONE.status_word.state):
        mask, value = pattern_bits(state.pattern)
        for e200 in (0x00, 0x21, 0xFF):
            word = e200 << 8 | number
            matching = [
                other.name
                for other in ONE.status_word.state
                if word & pattern_bits(other.pattern)[0] == pattern_bits(other.pattern)[1]
            ]
            assert matching == [state.name]
            assert word & mask == value
    assert names[4] == DriveState.OPERATION_ENABLED.label


def test_the_commands_of_the_control_byte():
    words = ControlWords(ONE.control_word)
    for word, enables in ((0x00, False), (0x01, True), (0x05, False), (0x04, False), (0x83, True)):
        assert words.enables(word) is enables, hex(word)


def test_every_event_of_the_table_has_a_text_and_its_code_too():
    """§9.3."""
    events = {int(number) for number in ONE.emcy.events}
    assert events == {*CODES, 30}
    assert {43, 50, 51, 53, 54}.isdisjoint(events)
    for event, (code, _) in CODES.items():
        assert f"{code:04X}" in ONE.emcy.codes, event


def test_the_event_byte_is_the_fourth_of_the_message():
    emergency = decode(bytes.fromhex("1043082903000000"))
    assert emergency is not None
    assert ONE.emcy.event is not None
    assert ONE.emcy.event.cause_byte is not None
    assert emergency.vendor[ONE.emcy.event.byte - 3] == 41
    assert emergency.vendor[ONE.emcy.event.cause_byte - 3] == 3


OTHER_WORDS = """
extends = "stoeber/5000"
[family]
name = "MDS 5000, position"
[process]
rpdo = ["control_word", "setpoint_1", "setpoint_2"]
tpdo = ["status_word", "value_1", "value_2"]
[[slot]]
name = "axis1"
[slot.rpdo]
objects = [["20B4:00/8"], ["3213:00"], ["3213:00"]]
[slot.tpdo]
objects = [["2830:00+28C8:00"], ["3050:00"], ["3050:00"]]
[[value]]
name = "velocity"
group = "command"
scale = { full = "C01", at = 16384 }
[[value]]
name = "position"
group = "actual"
words = ["value_1", "value_2"]
scale = { factor = 0.01 }
unit = "mm"
"""


def test_other_words_are_a_small_file_beside_the_site_file(tmp_path: Path):
    """A file of the site's own describes the settings made by POSITool."""
    (tmp_path / "mappings").mkdir()
    (tmp_path / "mappings" / "lift.toml").write_text(OTHER_WORDS, encoding="utf-8")
    family = load_family("lift", mapping_folders(tmp_path / "site.toml"))
    (slot,) = family.slot
    (tpdo,) = slot.tpdo
    assert (tpdo.number, tpdo.cob_id) == (1, 0x180)
    assert [str(refs[0]) for refs in tpdo.objects] == ["2830:00+28C8:00", "3050:00", "3050:00"]
    values = {value.leaf: value for value in family.value}
    assert values["actual/position"].word_names == ("value_1", "value_2")
    scale = values["command/velocity"].scale
    assert scale is not None
    assert scale.at == 16384
    assert family.emcy.events["41"] == ONE.emcy.events["41"]
