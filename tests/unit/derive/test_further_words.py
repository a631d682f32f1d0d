"""What PDOs of a derived drive carry beside its mode's words: sent with a right value, shown by its type."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.command import Outcome, Request, Start
from bridge.derive import derive_family
from bridge.drive import DriveState
from bridge.errors import OperationFailed
from tests.support.bench import PLC
from tests.support.invented_eds import (
    I8,
    I16,
    NODE_ID,
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


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
