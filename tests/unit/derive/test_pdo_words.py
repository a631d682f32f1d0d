"""Words in PDOs of a derived drive beside those of its mode: sent with a right value, shown by their type."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from cantools import database
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.base.errors import OperationFailed
from bridge.command import Outcome, Request, Start
from bridge.derive import derive_family
from bridge.drive import DriveState
from bridge.exports import dbc_file, modbus_table
from bridge.project import load_project
from tests.support.bench import PLC
from tests.support.invented_eds import (
    I8,
    I16,
    NODE_ID,
    REAL32,
    SPIN,
    U16,
    U32,
    DerivedBench,
    Section,
    described,
    mapped,
    pdo,
    var,
)
from tests.support.nightly import examples

MODE, TORQUE_LIMIT, RAMP = "0x60600008", "0x60720010", "0x20070020"
CURRENT, TEMPERATURE, ENERGY = "0x20100010", "0x20110008", "0x20120020"
OFF = "$NODEID+0x80000400"
DRIVE = {
    **SPIN,
    "2007": mapped("ramp", U32, default="70000"),
    "2010": mapped("Motor current", I16, "ro"),
    "2011": mapped("Temperature", I8, "ro"),
    "2012": mapped("Energy", U32, "ro"),
    "6072": mapped("max torque", U16, default="1000"),
    "6502": var("modes", U32, "ro", "2"),
}


def fixed(
    rpdos: dict[str, tuple[str, list[str]]], tpdos: dict[str, tuple[str, list[str]]]
) -> dict[str, Section]:
    """A drive whose PDO mapping cannot be changed, by the number of the communication object."""
    sections: dict[str, Section] = dict(DRIVE)
    for number, (cob_id, words) in {**rpdos, **tpdos}.items():
        sections |= pdo(number, cob_id, *words, access="rw")
        for name in (f"{int(number, 16) + 0x200:04X}sub{sub:X}" for sub in range(len(words) + 1)):
            sections[name] = {**sections[name], "AccessType": "const"}
    return sections


def run_up(bench: DerivedBench) -> None:
    (drive,) = bench.plant.drives.values()
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, drive.name, Start(direction=0)), outcomes.append)
    bench.run(1.0)
    assert [one.ok for one in outcomes] == [True], outcomes
    assert drive.channel.state is DriveState.OPERATION_ENABLED


def field(frame: bytes, at: int, size: int) -> int:
    return int.from_bytes(frame[at : at + size], "little")


WORDS = {
    MODE: (1, 2),
    TORQUE_LIMIT: (2, 1000),
    RAMP: (4, 70000),
    "0x60420010": (2, None),
    "0x60400010": (2, None),
}
"""Bytes, and what has to be in each frame."""


@pytest.mark.landing
@settings(max_examples=examples(12), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    further=st.lists(st.sampled_from([MODE, TORQUE_LIMIT]), unique=True, max_size=2),
    told=st.lists(st.sampled_from([CURRENT, TEMPERATURE]), unique=True, max_size=2),
    apart=st.booleans(),
    off=st.booleans(),
)
def test_every_word_that_a_derived_drive_is_sent_is_right_and_it_runs(
    tmp_path_factory: pytest.TempPathFactory, further: list[str], told: list[str], apart: bool, off: bool
) -> None:
    """The setpoint in the same RPDO as the control word, or in one of its own, which may be off."""
    own = OFF if off else "$NODEID+0x400"
    first = ["0x60400010", *further] if apart else ["0x60400010", *further, "0x60420010"]
    rpdos = {"1400": ("$NODEID+0x200", first)}
    if apart:
        rpdos["1402"] = (own, ["0x60420010"])
    sections = fixed(rpdos, {"1800": ("$NODEID+0x180", ["0x60410010", *told, "0x60440010"])})
    bench = DerivedBench(tmp_path_factory.mktemp("spin"), described(sections))
    run_up(bench)
    frames = [frame.data for frame in bench.log if frame.can_id == 0x200 + NODE_ID]
    assert frames
    at = 0
    for word in first:
        size, wanted = WORDS[word]
        if wanted is not None:
            assert {field(frame, at, size) for frame in frames} == {wanted}, word
        at += size
    (drive,) = bench.plant.drives
    assert bench.write(drive, velocity=300).ok
    bench.run(0.3)
    assert bench.value(f"{drive}/actual/velocity") == 300


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("word", "index", "held", "name", "shown"),
    [
        # -1 A is -1, and not 65535
        (CURRENT, "2010:00", 0xFFFF, "motor_current", -1),
        (TEMPERATURE, "2011:00", 0xF6, "temperature", -10),
        (ENERGY, "2012:00", 0x8000_0001, "energy", 0x8000_0001),
    ],
)
def test_a_further_word_that_it_tells_has_the_name_and_the_type_of_the_file(
    tmp_path: Path, word: str, index: str, held: int, name: str, shown: int
) -> None:
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", "0x60420010"])},
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010", word])},
    )
    place = f"{int(index[:4], 16):04X}"
    sections[place] = {**sections[place], "DefaultValue": f"0x{held:X}"}
    bench = DerivedBench(tmp_path, described(sections))
    bench.run(1.0)
    (drive,) = bench.plant.drives
    assert bench.value(f"{drive}/actual/{name}") == shown


def test_an_rpdo_with_nothing_else_is_preferred(tmp_path: Path) -> None:
    sections = fixed(
        {
            "1400": ("$NODEID+0x200", ["0x60400010", RAMP, "0x60420010"]),
            "1402": ("$NODEID+0x400", ["0x60400010", "0x60420010"]),
        },
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010"])},
    )
    text = derive_family(described(sections), "spin.eds").text
    assert "[[slot.rpdo]]\nnumber = 3\n" in text
    assert "[[slot.rpdo]]\nnumber = 1\n" not in text


def test_a_word_for_which_nobody_knows_a_value_is_refused_by_its_line() -> None:
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", TORQUE_LIMIT, "0x60420010"])},
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010"])},
    )
    sections["6072"] = mapped("max torque", U16)
    with pytest.raises(OperationFailed, match=r"RPDO1 carries 6072h:00 \(max torque\) too, and line \d+ of"):
        derive_family(described(sections), "spin.eds")


OFF_TPDO = "$NODEID+0x80000180"
MAPPABLE = {"1402": ("$NODEID+0x80000400", ["0", "0"]), "1802": ("$NODEID+0x80000380", ["0", "0", "0"])}


def with_type(sections: dict[str, Section], number: str, kind: str) -> None:
    sections[f"{number}sub2"] = {**sections[f"{number}sub2"], "DefaultValue": kind}


def free(sections: dict[str, Section], *numbers: str) -> None:
    """Let the mapping of these PDOs be written, which carries nothing at the factory."""
    for number in numbers:
        mapping = f"{int(number, 16) + 0x200:04X}"
        for name in [one for one in sections if one.startswith(f"{mapping}sub")]:
            sections[name] = {**sections[name], "AccessType": "rw"}
        sections[f"{mapping}sub0"] = {**sections[f"{mapping}sub0"], "DefaultValue": "0"}


@pytest.mark.landing(3)
@pytest.mark.parametrize("kind", ["255", "1", "253"])
def test_a_tpdo_that_is_off_is_switched_on_and_sent_with_each_change(tmp_path: Path, kind: str) -> None:
    """Bit 31 of 1800h:01, and a type that waits for SYNC or for a remote frame (CiA 301 §7.5.2.37)."""
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", "0x60420010"])},
        {"1800": (OFF_TPDO, ["0x60410010", "0x60440010", CURRENT])},
    )
    with_type(sections, "1800", kind)
    bench = DerivedBench(tmp_path, described(sections))
    run_up(bench)
    (drive,) = bench.plant.drives
    assert bench.write(drive, velocity=300).ok
    bench.run(0.3)
    assert bench.value(f"{drive}/actual/velocity") == 300


@pytest.mark.parametrize("number", ["1400", "1800"])
def test_a_pdo_that_is_off_for_good_is_refused_by_name(number: str) -> None:
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", "0x60420010"])},
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010"])},
    )
    off = sections[f"{number}sub1"]["DefaultValue"].replace("+0x", "+0x80000")
    sections[f"{number}sub1"] |= {"DefaultValue": off, "AccessType": "const"}
    kind = "RPDO" if number < "1800" else "TPDO"
    with pytest.raises(OperationFailed, match=f"{kind}1 is off and cannot be switched on"):
        derive_family(described(sections), "spin.eds")


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("rpdo", "tpdo"),
    [
        # the setpoint and the actual value are missing
        (["0x60400010"], ["0x60410010"]),
        # nothing is there
        ([RAMP], [CURRENT]),
        # a word for which nobody knows a value is beside them
        (["0x60400010", "0x20080010", "0x60420010"], ["0x60410010", "0x60440010"]),
    ],
)
def test_what_no_pdo_carries_is_mapped_into_one_that_is_free(
    tmp_path: Path, rpdo: list[str], tpdo: list[str]
) -> None:
    sections = fixed(
        {"1400": ("$NODEID+0x200", rpdo), "1402": MAPPABLE["1402"]},
        {"1800": ("$NODEID+0x180", tpdo), "1802": MAPPABLE["1802"]},
    )
    sections["2008"] = mapped("torque limit", U16)
    free(sections, "1402", "1802")
    bench = DerivedBench(tmp_path, described(sections))
    run_up(bench)
    (drive,) = bench.plant.drives
    assert bench.write(drive, velocity=300).ok
    bench.run(0.3)
    assert bench.value(f"{drive}/actual/velocity") == 300


def test_a_further_real_number_is_a_real_number_in_points_dbc_and_exports(tmp_path: Path) -> None:
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", "0x60420010", "0x20150020"])},
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010", "0x20140020"])},
    )
    sections["2014"] = mapped("Motor current", REAL32, "ro", "-1.5")
    sections["2015"] = mapped("Current limit", REAL32, default="2.5")
    bench = DerivedBench(tmp_path, described(sections))
    run_up(bench)
    (drive,) = bench.plant.drives
    point = f"{drive}/actual/motor_current"
    assert bench.value(point) == -1.5
    frames = [frame.data for frame in bench.log if frame.can_id == 0x200 + NODE_ID]
    assert {struct.unpack_from("<f", data, 4)[0] for data in frames} == {2.5}
    assert bench.write(drive, current_limit=0.75).ok
    bench.run(0.1)
    last = [frame.data for frame in bench.log if frame.can_id == 0x200 + NODE_ID][-1]
    assert struct.unpack_from("<f", last, 4) == (0.75,)
    project = load_project(next(tmp_path.glob("*.toml")))
    rows = {str(row["name"]): row["type"] for row in modbus_table(project).facts}
    assert rows["actual/motor_current"] == rows["command/current_limit"] == "float32"
    found = database.load_string(dbc_file(project, 0), "dbc")
    assert isinstance(found, database.Database)
    signals = {one.name: one for message in found.messages for one in message.signals}
    for name in ("motor_current", "current_limit"):
        assert signals[name].is_float
        assert signals[name].length == 32


def test_three_bytes_are_refused_by_name() -> None:
    """INTEGER24 fills no words."""
    sections = fixed(
        {"1400": ("$NODEID+0x200", ["0x60400010", "0x60420010"])},
        {"1800": ("$NODEID+0x180", ["0x60410010", "0x60440010", "0x20160018"])},
    )
    sections["2016"] = mapped("Turns", "0x10", "ro")
    with pytest.raises(OperationFailed, match=r"TPDO1 has 2016h:00 \(Turns\) of 24 bits beside it"):
        derive_family(described(sections), "spin.eds")
