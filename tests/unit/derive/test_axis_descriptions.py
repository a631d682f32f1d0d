"""Drives with several axes: what is made of their descriptions, and how they are driven by it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.command import Action, Identity, Outcome, Request, Role, Source, WriteParameter
from bridge.derive import derive_family
from bridge.derive.axis_descriptions import AxisDescription
from bridge.derive.family import NotDerived
from bridge.drive import DriveState
from bridge.eds import Description
from bridge.mapping.axes import on_axis
from bridge.sim.core.nmt_slave import SlaveState
from bridge.text import Text, render
from tests.support.invented_eds import (
    BASIC,
    SPIN,
    U8,
    U16,
    U32,
    DerivedBench,
    Section,
    axis_objects,
    axis_pdos,
    described,
    family_of,
    mapped,
    pdo,
    record,
    var,
)

FIRST = Identity(Source.MODBUS, "10.0.0.1")
SECOND = Identity(Source.MODBUS, "10.0.0.2")
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
TIMEOUT_MS = 200
WATCH = {**record("1016", "consumer heartbeat", var("entry", U32, "rw", "0"))}
ACCELERATION = mapped("acceleration", U32, default="100")


def cob_ids(axis: int) -> tuple[str, str]:
    """Predefined ones for four axes, and free ones beyond."""
    is_predefined = axis <= 4
    rpdo = 0x100 + 0x100 * axis if is_predefined else 0x200 + 8 * axis
    tpdo = 0x80 + 0x100 * axis if is_predefined else 0x180 + 8 * axis
    return f"$NODEID+0x{rpdo:X}", f"$NODEID+0x{tpdo:X}"


def device(*axes: int, step: int = 1, access: str = "rw", **more: Section) -> dict[str, Section]:
    """Each axis has its PDOs ``step`` behind those of the one before."""
    sections: dict[str, Section] = {**BASIC, **WATCH}
    for place, axis in enumerate(axes):
        sections |= axis_objects(axis) | axis_pdos(axis, step * place, cob_ids(place + 1), access)
        sections[f"{on_axis(0x6083, axis):04X}"] = ACCELERATION
    return sections | more


def shared(access: str) -> dict[str, Section]:
    """Both axes in the same PDOs, and a second pair that is empty."""
    of_device: dict[str, Section] = {**BASIC, **WATCH, **axis_objects(1), **axis_objects(2)}
    commands = ("0x60400010", "0x60420010", "0x68400010", "0x68420010")
    told = ("0x60410010", "0x60440010", "0x68410010", "0x68440010")
    of_device |= pdo("1400", "$NODEID+0x200", *commands, access=access)
    of_device |= pdo("1800", "$NODEID+0x180", *told, access=access)
    of_device |= pdo("1401", "$NODEID+0x300", *["0"] * 4, access=access)
    return of_device | pdo("1801", "$NODEID+0x280", *["0"] * 4, access=access)


def without_cob_ids(sections: Mapping[str, Section]) -> dict[str, Section]:
    """PDOs from the 65th on are off, and nobody says where they would be (CiA 301 §7.5.2.35)."""
    found = dict(sections)
    for name in ("1440sub1", "1840sub1"):
        found[name] = {**found[name], "DefaultValue": "0x80000000"}
    return found


IO_FIRST = {
    **{name: one for name, one in device(2).items() if not name.startswith(("14", "16", "18", "1A"))},
    "1000": var("device type", U32, "ro", "0xFFFF0191"),
    "67FF": var("device type", U32, "ro", "0x30191"),
    "6FFF": var("device type", U32, "ro", "0x10192"),
    **record("6000", "inputs", mapped("left", U8, "ro", "0x5A")),
    **record("6200", "outputs", mapped("left", U8)),
    **pdo("1400", "$NODEID+0x200", "0x62000108"),
    **pdo("1800", "$NODEID+0x180", "0x60000108"),
    **axis_pdos(2, 1, cob_ids(2)),
}
"""Inputs and outputs of CiA 401, and a drive as the second logical device (CiA 301 §7.5.2.1)."""
FORMS = {
    "PDOs that are far apart": (device(1, 2, step=64), ["axis1", "axis2"]),
    "PDO1 and PDO2": (device(1, 2), ["axis1", "axis2"]),
    "a fixed mapping": (device(1, 2, access="const"), ["axis1", "axis2"]),
    "eight axes": (device(*range(1, 9), step=64), [f"axis{axis}" for axis in range(1, 9)]),
    "both in PDO1, which can be mapped": (shared("rw"), ["axis1", "axis2"]),
    "PDOs without a COB-ID": (without_cob_ids(device(1, 2, step=64)), ["axis1", "axis2"]),
    "the third logical device is the second axis": (device(1, 3), ["axis1", "axis3"]),
    "a drive behind inputs and outputs": (IO_FIRST, ["axis2"]),
}


def bench_of(folder: Path, sections: Mapping[str, Section], timeout_ms: int = TIMEOUT_MS) -> DerivedBench:
    return DerivedBench(folder, described(sections), timeout_ms=timeout_ms)


def run_up(bench: DerivedBench, drive: str, identity: Identity, velocity: int) -> None:
    bench.write(drive, identity, control_word=0x0080, velocity=0)
    for word in (0x0006, 0x007F):
        assert bench.write(drive, identity, control_word=word, velocity=velocity).ok
        bench.run(0.05)


def written(bench: DerivedBench, drive: str, name: str, value: int) -> Outcome:
    outcomes: list[Outcome] = []
    bench.view.submit(Request(ENGINEER, drive, WriteParameter(name, value)), outcomes.append)
    bench.run(0.5)
    (outcome,) = outcomes
    return outcome


@pytest.mark.landing(2)
@pytest.mark.parametrize("form", FORMS)
def test_each_axis_is_a_drive_of_its_own(tmp_path: Path, form: str) -> None:
    sections, slots = FORMS[form]
    bench = bench_of(tmp_path, sections, timeout_ms=0)
    node = next(iter(bench.plant.nodes.values()))
    drives = [drive.name.partition("/")[2] for drive in node.drives]
    assert drives == (slots if len(slots) > 1 else ["drive"]), bench.value(f"{node.name}/node/boot_status")
    for place, drive in enumerate(bench.plant.drives, 1):
        run_up(bench, drive, FIRST, 100 * place)
        assert bench.plant.drives[drive].channel.state is DriveState.OPERATION_ENABLED, drive
        assert bench.value(f"{drive}/actual/velocity") == 100 * place
    assert [axis.is_enabled for axis in bench.generic.axes] == [True] * len(slots)


def test_a_silent_owner_stops_its_axis_and_no_other(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, device(1, 2, step=64))
    first, second = bench.plant.drives
    run_up(bench, first, FIRST, 300)
    run_up(bench, second, SECOND, 400)
    for _ in range(10):
        assert bench.write(second, SECOND, control_word=0x007F, velocity=400).ok
        bench.run(0.05)
    states = [drive.channel.state for drive in bench.plant.drives.values()]
    assert states[1] is DriveState.OPERATION_ENABLED
    assert [axis.is_enabled for axis in bench.generic.axes] == [False, True]
    assert bench.value(f"{second}/actual/velocity") == 400
    assert not bench.write(second, FIRST, control_word=0).ok, "each axis has its own owner"


def test_a_fault_is_that_axis_s_and_told_by_its_own_error_code(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, device(1, 2, step=64), timeout_ms=0)
    first, second = bench.plant.drives
    run_up(bench, first, FIRST, 300)
    run_up(bench, second, SECOND, 400)
    bench.generic.fail(0x2310, axis=1)
    bench.run(2.5)
    states = [drive.channel.state for drive in bench.plant.drives.values()]
    assert states == [DriveState.OPERATION_ENABLED, DriveState.FAULT]
    of_node = [event.source for event in bench.events if "emergency 2310h" in event.message]
    assert of_node == ["conveyor"], "whose it is the message does not say"
    assert "2310" in str(bench.value(f"{second}/status/fault_text"))
    assert not bench.value(f"{first}/status/fault_text")
    assert bench.value(f"{first}/actual/velocity") == 300


def test_nmt_stop_ends_all_axes(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, device(1, 2, step=64), timeout_ms=0)
    for drive in bench.plant.drives:
        run_up(bench, drive, FIRST, 300)
    assert bench.ask(Action.QUICK_STOP, next(iter(bench.plant.drives)), FIRST).ok
    bench.run(0.1)
    assert [axis.is_enabled for axis in bench.generic.axes] == [False, True]
    assert bench.ask(Action.STOP_NODE, next(iter(bench.plant.nodes)), ENGINEER).ok
    bench.run(0.1)
    assert bench.generic.slave.state is SlaveState.STOPPED
    assert [axis.is_enabled for axis in bench.generic.axes] == [False, False]


def test_a_parameter_has_one_name_and_reaches_its_axis(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, device(1, 2, step=64), timeout_ms=0)
    drives = list(bench.plant.drives)
    for place, drive in enumerate(drives, 1):
        assert written(bench, drive, "6083", 1000 * place).ok
    assert [bench.generic.value((index, 0)) for index in (0x6083, 0x6883)] == [1000, 2000]


def test_an_enabled_axis_keeps_what_it_rests_on_and_lets_the_other_be_set(tmp_path: Path) -> None:
    gain = {"2010": mapped("gain", U16)}
    bench = bench_of(tmp_path, {**device(1, 2, step=64), **gain}, timeout_ms=0)
    first, second = bench.plant.drives
    run_up(bench, second, SECOND, 400)
    assert written(bench, first, "6060", 3).ok, "its own mode, while the other one runs"
    refused = "is not written while the drive is enabled"
    assert refused in written(bench, second, "6060", 3).message
    assert refused in written(bench, first, "2010", 7).message, "what both rest on"
    assert refused in written(bench, first, "6860:00", 3).message, "the other's, by its object"


@pytest.mark.parametrize(
    ("sections", "why"),
    [
        pytest.param(
            shared("const"),
            r"axis 1: no RPDO of the device carries 6040h, .*\(RPDO1, TPDO1: of several axes, and cannot be",
            id="both in a fixed PDO",
        ),
        pytest.param(
            {name: one for name, one in device(1, 2).items() if name != "6842"},
            "velocity: axis 2: it has not this mode, and all axes are driven in the same",
            id="modes that differ",
        ),
        pytest.param(
            {
                name: one
                for name, one in device(1, 2, access="const").items()
                if not name.startswith(("1401", "1601"))
            },
            "axis 2: no RPDO of the device carries 6840h, and none can be made to$",
            id="an axis without RPDO",
        ),
    ],
)
def test_what_cannot_be_driven_is_refused_in_one_sentence(sections: Mapping[str, Section], why: str) -> None:
    with pytest.raises(OperationFailed, match=why) as refused:
        derive_family(described(sections), "spin.eds")
    assert "\n" not in str(refused.value)


def test_a_refusal_names_the_objects_of_the_axis_in_both_languages() -> None:
    no_rpdo = {
        name: one for name, one in device(1, 2, access="const").items() if name[:4] not in ("1401", "1601")
    }
    with pytest.raises(NotDerived) as refused:
        derive_family(described(no_rpdo), "spin.eds")
    assert str(refused.value) == (
        "spin.eds: velocity: axis 2: no RPDO of the device carries 6840h, and none can be made to"
    )
    assert render(refused.value.said, "de") == (
        "spin.eds: velocity: Achse 2: kein RPDO des Geräts trägt 6840h, und keines lässt sich dazu bringen"
    )


def test_objects_among_the_facts_of_a_text_are_those_of_the_axis() -> None:
    view = AxisDescription(2, Description("EDS"))
    inner = Text.of("derive.missing_many", objects=("6040h", "1017h", Text.plain("6041h")))
    said = Text.of("derive.profile", line=6040, profile=0x6040, wanted=inner)
    assert str(view.of_node(said)) == (
        "1000h in line 6040 has the profile 24640, not 6840h and 1017h and 6841h are not described"
    )


def test_beyond_the_predefined_cob_ids_the_file_has_to_say_them() -> None:
    sections = dict(device(*range(1, 6), step=64))
    for name in ("1500sub1", "1900sub1"):
        sections[name] = {**sections[name], "DefaultValue": "0x80000000"}
    with pytest.raises(OperationFailed, match=r"axis 5: .*no COB-ID .*give it one in the file"):
        derive_family(described(sections), "spin.eds")


def test_inputs_beside_the_axes_are_points_of_the_node(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, IO_FIRST, timeout_ms=0)
    (node,) = bench.plant.nodes
    bench.run(1.5)
    assert bench.value(f"{node}/node/inputs_left") == 0x5A
    bench.generic.set_value((0x6000, 1), 0x33)
    bench.run(0.3)
    assert bench.value(f"{node}/node/inputs_left") == 0x33, "by its TPDO, before it is polled"
    text = derive_family(described(IO_FIRST), "spin.eds").text
    assert "# Left out: RPDO1, which commands 6200h:01 and no drive." in text


def test_a_further_word_of_both_axes_has_one_name(tmp_path: Path) -> None:
    torque = {"6077": mapped("torque", U16, "ro", "7"), "6877": mapped("torque", U16, "ro", "8")}
    sections = {**device(1, 2, access="const"), **torque}
    for number, index in (("1A00", "6077"), ("1A01", "6877")):
        words = [sections[f"{number}sub{sub}"]["DefaultValue"] for sub in (1, 2, 3)]
        base = cob_ids(int(number[3]) + 1)[1]
        words.append(f"0x{index}0010")
        sections |= pdo(f"{int(number, 16) - 0x200:04X}", base, *words, access="const")
    bench = bench_of(tmp_path, sections, timeout_ms=0)
    for drive in bench.plant.drives:
        run_up(bench, drive, FIRST, 100)
    assert [bench.value(f"{drive}/actual/torque") for drive in bench.plant.drives] == [7, 8]


def test_the_text_names_objects_as_the_node_has_them() -> None:
    text = derive_family(described(device(1, 2, step=64)), "spin.eds").text
    second = text[text.index('name = "axis2"') :]
    assert re.findall(r'"(6[0-9A-F]{3}):00', second[: second.index("[[value]]")])[:4] == [
        "6860",
        "6840",
        "6842",
        "6841",
    ]
    assert "number = 65\n" in second


def test_one_axis_is_derived_as_ever(tmp_path: Path) -> None:
    family = family_of(tmp_path, derive_family(described(SPIN), "spin.eds"))
    assert [(slot.name, slot.axis) for slot in family.slot] == [("drive", 1)]
