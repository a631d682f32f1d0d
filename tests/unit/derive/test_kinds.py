"""Kind of a device by its profile and its words: a drive, a device, or one that is only read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults, OperationFailed
from bridge.command import Identity, Outcome, Request, Role, Source, WriteParameter
from bridge.derive import derive_family
from bridge.derive.device_family import GENERIC
from bridge.lint import Severity, lint
from bridge.mapping.entry_types import said_of
from bridge.mapping.loader import read_family
from bridge.project import load_project
from bridge.sim.core.nmt_slave import SlaveState
from bridge.text import LANGUAGES, render
from tests.support import sites
from tests.support.invented_eds import (
    BASIC,
    I8,
    SPIN,
    U16,
    U32,
    DerivedBench,
    Section,
    described,
    eds,
    family_of,
    mapped,
    pdo,
    record,
    var,
)

ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
CONTROL, STATUS = mapped("control word", U16), mapped("status word", U16, "ro")
ACCELERATION = record("6040", "acceleration value", mapped("channel 1", I8, "ro"))
POSITION = {
    **pdo("1800", "$NODEID+0x180", "0x60040020"),
    "2001": var("gain", U16),
    "6004": mapped("position", U32, "ro"),
}
OUTPUT = {**pdo("1400", "$NODEID+0x200", "0x62000008"), "6200": mapped("valves", I8)}
WORDS = {"6040": CONTROL, "6041": STATUS}


def profile(number: int, *more: Mapping[str, Section]) -> dict[str, Section]:
    sections = {**BASIC, **POSITION, **OUTPUT, "1000": var("device type", U32, "ro", hex(number))}
    for one in more:
        sections |= one
    return sections


@pytest.mark.landing(10)
@pytest.mark.parametrize(
    ("sections", "outputs", "reason"),
    [
        pytest.param(profile(406), True, "", id="encoder"),
        pytest.param(profile(406, ACCELERATION), True, "", id="encoder that measures acceleration"),
        pytest.param(profile(406, {"6040": mapped("acceleration", U32, "ro")}), True, "", id="its 6040h"),
        pytest.param(profile(401, {"6041": mapped("polarity", U16)}), True, "", id="inputs and outputs"),
        pytest.param(profile(408, WORDS), True, "", id="valve, whose words CiA 408 has"),
        pytest.param(profile(0), True, "", id="no profile"),
        pytest.param(
            profile(401, WORDS),
            False,
            "1000h in line [0-9]+ has the profile 401, not 402",
            id="drive that says 401",
        ),
        pytest.param(profile(402), False, "6040h and 6041h are not described", id="drive without words"),
        pytest.param(
            profile(402, {"6041": STATUS}), False, "6040h is not described", id="drive without control word"
        ),
        pytest.param(profile(0, {"6041": STATUS}), False, "6040h is not described", id="status word alone"),
    ],
)
def test_a_device_is_what_its_number_says(
    tmp_path: Path, sections: Mapping[str, Section], outputs: bool, reason: str
) -> None:
    made = derive_family(described(sections), "spin.eds")
    assert made.base == GENERIC
    family = family_of(tmp_path, made)
    assert [one.name for one in family.input] == ["position"]
    assert bool(family.output) is outputs
    assert re.search(reason, str(made.read_only))
    assert bool(made.read_only) is bool(reason)
    for language in LANGUAGES:
        told, wanted = said_of(family.family.read_only), made.read_only
        assert render(told, language) == render(wanted, language)


@pytest.mark.parametrize(
    "sections",
    [
        profile(402, {"6040": CONTROL}),
        profile(0, {"6040": CONTROL}),
        profile(402, {"6040": mapped("control word", U32), "6041": STATUS}),
        {name: keys for name, keys in SPIN.items() if name != "6040"},
    ],
)
def test_half_a_drive_that_can_be_commanded_is_refused(sections: Mapping[str, Section]) -> None:
    with pytest.raises(OperationFailed, match="describes no drive that follows CiA 402"):
        derive_family(described(sections), "spin.eds")


def test_a_mode_is_asked_of_drives_alone() -> None:
    with pytest.raises(OperationFailed, match="describes no drive that follows CiA 402"):
        derive_family(described(profile(406)), "spin.eds", "velocity")


def test_what_is_only_read_is_served_and_refuses_every_write_with_the_reason(tmp_path: Path) -> None:
    bench = DerivedBench(tmp_path, described(profile(402)))
    assert bench.generic.slave.state is SlaveState.OPERATIONAL
    for name in ("2001", "1017:00", "6200:00", "5000:01"):
        asked: list[Outcome] = []
        bench.view.submit(Request(ENGINEER, "conveyor", WriteParameter(name, 7)), asked.append)
        bench.run(0.2)
        (outcome,) = asked
        assert not outcome.ok
        assert "6040h and 6041h are not described" in outcome.message


def test_check_says_what_is_only_read(tmp_path: Path) -> None:
    (tmp_path / "spin.eds").write_bytes(eds(profile(402)))
    node = sites.node(name="spin", mapping="eds:spin.eds")
    project = load_project(sites.write(tmp_path, sites.bus(node), sites.modbus()))
    verdict = lint(project.site, project.families, project.path, project.downloads)
    (said,) = verdict.of(Severity.WARNING)
    assert said.fault.key == "bus[0].node[0].mapping"
    assert said.fault.message.startswith("spin is only read: ")
    assert "6040h and 6041h are not described" in said.fault.message


def test_what_is_only_read_has_no_outputs(tmp_path: Path) -> None:
    text = derive_family(described(profile(401)), "spin.eds").text
    path = tmp_path / "spin.toml"
    path.write_text(text.replace("profile = 401", 'profile = 401\nread_only = "so"'), encoding="utf-8")
    with pytest.raises(FileFaults, match=r"family.read_only: .*output"):
        read_family(path)
