"""The CiA 402 families: what the standard says of words, states and names (IEC 61800-7-201)."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.mapping import family_names, load_family
from bridge.mapping.loader import mapping_folders, read_family
from bridge.mapping.match import Found, best_match
from bridge.mapping.site_families import load_site_and_families
from bridge.parameter import Names
from bridge.sim.cia402.cia402_catalogue import MAPPINGS
from bridge.sim.cia402.cia402_states import Cia402Command, Cia402State, command_of
from tests.support import sites

FAMILIES = {name: load_family(f"cia402/{name}") for name in MAPPINGS}
ANY = FAMILIES["profile-velocity"]
STATES = {
    Cia402State.NOT_READY: DriveState.NOT_READY,
    Cia402State.SWITCH_ON_DISABLED: DriveState.SWITCH_ON_INHIBITED,
    Cia402State.READY: DriveState.READY,
    Cia402State.SWITCHED_ON: DriveState.SWITCHED_ON,
    Cia402State.ENABLED: DriveState.OPERATION_ENABLED,
    Cia402State.QUICK_STOP_ACTIVE: DriveState.QUICK_STOP_ACTIVE,
    Cia402State.FAULT_REACTION: DriveState.FAULT_REACTION_ACTIVE,
    Cia402State.FAULT: DriveState.FAULT,
}


def test_there_is_one_file_for_each_mode_and_the_base_is_none():
    assert {name for name in family_names() if name.startswith("cia402/")} == {
        f"cia402/{name}" for name in MAPPINGS
    }
    with pytest.raises(FileFaults, match="template"):
        load_family("cia402/base")


@pytest.mark.parametrize("kind", [0x0000_0192, 0x0001_0192, 0x0002_0192, 0x0042_0192])
def test_the_low_word_of_1000h_tells_the_profile(kind: int):
    families = {f"cia402/{name}": family for name, family in FAMILIES.items()}
    assert best_match(Found(device_type=kind), families)
    assert not best_match(Found(device_type=kind & ~0xFF | 0x91), families)


@pytest.mark.parametrize("name", MAPPINGS)
def test_every_state_is_told_whatever_the_other_bits_are(name: str):
    words = StatusWords(FAMILIES[name].status_word)
    for state, expected in STATES.items():
        for others in (0x0000, 0xFF90, 0x1200):
            # Bit 5 is not of interest in the states that leave it open.
            assert words.state(state | others) is expected
    assert words.state(words.as_fault(0x1637)) is DriveState.FAULT


@pytest.mark.parametrize("name", MAPPINGS)
def test_the_words_are_the_commands_of_the_standard(name: str):
    words = ControlWords(FAMILIES[name].control_word)
    assert command_of(words.stopped) is Cia402Command.DISABLE_VOLTAGE
    assert command_of(words.ready) is Cia402Command.SHUTDOWN
    assert command_of(words.run) is Cia402Command.ENABLE_OPERATION
    assert command_of(words.stop(words.run)) is Cia402Command.SWITCH_ON
    assert command_of(words.quick_stop(words.run)) is Cia402Command.QUICK_STOP
    assert command_of(words.disable_voltage(words.run)) is Cia402Command.DISABLE_VOLTAGE
    assert words.acknowledge_mask == 0x0080
    assert words.enables(words.run | words.begin)


def test_the_bits_of_the_modes():
    runs = {
        name: f"{family.control_word.run | family.control_word.begin:04X}"
        for name, family in FAMILIES.items()
    }
    assert runs == {
        "velocity": "007F",
        "profile-velocity": "000F",
        "profile-position": "002F",
        "homing": "001F",
        "cyclic-position": "000F",
        "cyclic-velocity": "000F",
    }


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("6083", "6083:00"),
        ("6083:00", "6083:00"),
        ("0x6083:00", "6083:00"),
        ("60ff", "60FF:00"),
        ("6046:01", "6046:01"),
        ("1A00:0A", "1A00:0A"),
        ("603F", "603F:00"),
    ],
)
def test_parameters_are_named_by_their_index(name: str, place: str):
    assert str(Names(ANY).resolve(name).address).upper().replace("H", "") == place


def test_emergencies_have_their_text_or_that_of_their_group():
    assert str(ANY.emcy.text(0x8611)) == "following error"
    assert str(ANY.emcy.text(0x3211)) == "DC link voltage"
    assert str(ANY.emcy.text(0x8130)) == "life guarding or heartbeat"
    assert str(ANY.emcy.text(0xFF42)) == "manufacturer's own"
    groups = {code[:2] for code in ANY.emcy.codes if code.endswith("xx")}
    assert {code[:2] for code in ANY.emcy.codes} == groups


SCALED = """
extends = "cia402/profile-velocity"
[[value]]
name = "velocity"
group = "command"
unit = "1/min"
scale = { factor = 0.006 }
[[value]]
name = "velocity"
group = "actual"
unit = "1/min"
scale = { factor = 0.006 }
"""


def site_family(folder: Path, text: str):
    (folder / "mappings").mkdir()
    path = folder / "mappings" / "own.toml"
    path.write_text(text, encoding="utf-8")
    return read_family(path, mapping_folders(folder / "site.toml"))


def test_a_sites_own_units_are_a_small_file(tmp_path: Path):
    family = site_family(tmp_path, SCALED)
    values = {value.leaf: value for value in family.value}
    assert values["command/velocity"].unit == "1/min"
    assert values["command/velocity"].word_names == ("setpoint_1", "setpoint_2")
    scale = values["actual/velocity"].scale
    assert scale is not None
    assert scale.factor == 0.006


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('follows = "speed"', "there is no actual value 'speed'"),
        ('follows = "mode"', "mode has other words"),
        ('follows = "position"\nscale = { factor = 2.0 }', "position has other words or another scale"),
    ],
)
def test_what_a_command_follows_must_be_like_it(tmp_path: Path, text: str, message: str):
    head = 'extends = "cia402/cyclic-position"\n[[value]]\nname = "position"\ngroup = "command"\n'
    with pytest.raises(FileFaults, match=message):
        site_family(tmp_path, head + text)


@pytest.mark.parametrize(
    ("handshake", "message"),
    [
        ('{ value = "speed", bit = 4, acknowledge_bit = 12 }', "there is no command value 'speed'"),
        ('{ value = "position", bit = 3, acknowledge_bit = 12 }', "is a bit of enabling"),
        ('{ value = "position", bit = 7, acknowledge_bit = 12 }', "of the acknowledge"),
    ],
)
def test_a_handshake_must_have_its_value_and_its_own_bit(tmp_path: Path, handshake: str, message: str):
    head = 'extends = "cia402/profile-position"\n[control_word]\n'
    with pytest.raises(FileFaults, match=message):
        site_family(tmp_path, f"{head}handshake = {handshake}\n")


def test_scan_names_the_preferred_mode() -> None:
    """1000h is the same whatever mode a drive is used in."""
    families = {name: load_family(name) for name in family_names()}
    match = best_match(Found(device_type=0x0002_0192), families)
    assert match is not None
    assert match.mapping == "cia402/profile-velocity"


@pytest.mark.parametrize(
    ("period_ms", "message"),
    [
        (0, "must not be 0: CiA 402, cyclic synchronous position writes it into 60C2:01 of uint8"),
        (300, "writes it into 60C2:01 of uint8: a uint8 is 0…255"),
    ],
)
def test_a_sync_period_that_60c2h_cannot_hold_is_a_fault(tmp_path: Path, period_ms: int, message: str):
    axis = sites.node(sites.drive("drive", "modbus", 500, ""), name="axis", mapping="cia402/cyclic-position")
    path = sites.write(tmp_path, sites.bus(axis, more=f"sync_period_ms = {period_ms}"), sites.modbus())
    with pytest.raises(FileFaults, match=f"bus.0..sync_period_ms: .*{message}"):
        load_site_and_families(path)


@pytest.mark.landing(2)
@pytest.mark.parametrize("kind", ["bool", "real32"])
def test_the_sync_period_needs_an_integer(tmp_path: Path, kind: str):
    head = 'extends = "cia402/cyclic-velocity"\n[[slot]]\nname = "drive"\n'
    start = f'start = [{{ object = "60C2:01", type = "{kind}", value = "sync_period_ms" }}]\n'
    with pytest.raises(FileFaults, match="value: "):
        site_family(tmp_path, head + start)
