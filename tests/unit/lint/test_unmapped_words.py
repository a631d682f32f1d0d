"""Mappings written by hand whose process data are not all sent, or not with a right value."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import CheckResult, Severity, lint
from bridge.mapping import family_names, load_family
from bridge.project import load_project
from tests.support import sites
from tests.support.invented_eds import SPIN, Section, eds, pdo

PROCESS = """\
extends = "cia402/velocity"
[family]
name = "Spin"
vendor = "Acme"
source = "by hand"
[process]
rpdo = {rpdo}
tpdo = ["status_word", "value_1", "value_2"]
{rest}
"""
SLOT = '[[slot]]\nname = "drive"\n'
FIRST = "[[slot.rpdo]]\nnumber = 1\ncob_id = 0x200\nwords = {words}\nobjects = {objects}\n"
THIRD = '[[slot.rpdo]]\nnumber = 3\ncob_id = 0x400\nwords = ["setpoint_1"]\nobjects = [["6042:00"]]\n'
OFF: dict[str, Section] = {
    **SPIN,
    **pdo("1400", "$NODEID+0x200", "0x60400010"),
    **pdo("1402", "$NODEID+0x80000400", "0x60420010"),
}


def judged(
    folder: Path, mapping: str, sections: dict[str, Section] | None = None, drive: str = ""
) -> CheckResult:
    place = folder / "mappings" / "acme"
    place.mkdir(parents=True)
    (place / "spin.toml").write_text(mapping, encoding="utf-8")
    if sections is not None:
        (place / "spin.eds").write_bytes(eds(sections))
    node = sites.node(sites.drive("drive", "modbus", 200, drive), mapping="acme/spin", node_id=5)
    project = load_project(sites.write(folder, sites.bus(node), sites.modbus()))
    return lint(project.site, project.families, project.path, project.downloads)


def said(verdict: CheckResult, severity: Severity, part: str) -> list[str]:
    return [one.fault.message for one in verdict.of(severity) if part in one.fault.message]


def one_rpdo(words: str, objects: str, rest: str = "") -> str:
    process = PROCESS.format(rpdo=words, rest=rest)
    return process + SLOT + FIRST.format(words=words, objects=objects)


APART = PROCESS.format(rpdo='["control_word", "setpoint_1"]', rest="") + SLOT
APART += FIRST.format(words='["control_word"]', objects='[["6040:00"]]')


def test_a_word_that_no_pdo_carries_is_an_error(tmp_path: Path) -> None:
    (error,) = said(judged(tmp_path, APART), Severity.ERROR, "carried by no")
    assert error == "setpoint_1 of conveyor/drive is carried by no RPDO"


def test_a_pdo_that_the_device_has_off_is_an_error_where_nothing_switches_it_on(tmp_path: Path) -> None:
    """Bit 31 of 1402h:01 (CiA 301 §7.5.2.35)."""
    (error,) = said(judged(tmp_path, APART + THIRD, OFF), Severity.ERROR, "is off")
    assert error.startswith("RPDO3 is off in the device's description, and nothing switches it on")


@pytest.mark.parametrize(
    ("written", "drive"), [("write = true\n", ""), ("", "[[bus.node.drive.rpdo]]\nnumber = 3\n")]
)
def test_it_is_none_where_somebody_does(tmp_path: Path, written: str, drive: str) -> None:
    assert not said(judged(tmp_path, APART + THIRD + written, OFF, drive), Severity.ERROR, "is off")


WITH_MODE = '["control_word", "setpoint_1", "setpoint_2"]'


@pytest.mark.parametrize("mode", ["6060:00/8", "6060:00/8+2005:00/8"])
def test_a_mode_of_operation_that_is_sent_as_0_is_an_error(tmp_path: Path, mode: str) -> None:
    mapping = one_rpdo(WITH_MODE, f'[["6040:00"], ["6042:00"], ["{mode}"]]')
    (error,) = said(judged(tmp_path, mapping), Severity.ERROR, " sends ")
    assert error == "RPDO1 of conveyor/drive sends 6060h:00 as 0, which is no mode of operation"


def test_a_mode_that_rests_is_none(tmp_path: Path) -> None:
    mapping = one_rpdo(WITH_MODE, '[["6040:00"], ["6042:00"], ["6060:00/8"]]', "rest = { setpoint_2 = 2 }")
    verdict = judged(tmp_path, mapping)
    assert not said(verdict, Severity.ERROR, " sends ")
    assert not said(verdict, Severity.WARNING, " sends ")


def test_a_torque_limit_that_is_sent_as_0_is_a_warning(tmp_path: Path) -> None:
    mapping = one_rpdo(WITH_MODE, '[["6040:00"], ["6042:00"], ["6072:00"]]')
    (warning,) = said(judged(tmp_path, mapping), Severity.WARNING, " sends ")
    assert warning.startswith("RPDO1 of conveyor/drive sends 6072h:00 as 0, until somebody commands it")


@pytest.mark.landing(22)
@pytest.mark.parametrize("name", [one for one in family_names() if load_family(one).slot])
def test_our_own_mappings_carry_every_word_and_send_no_setting_as_0(tmp_path: Path, name: str) -> None:
    slot = load_family(name).slot[0].name
    node = sites.node(sites.drive(slot, "modbus", 200, ""), mapping=name, node_id=5)
    project = load_project(sites.write(tmp_path, sites.bus(node), sites.modbus()))
    verdict = lint(project.site, project.families, project.path, project.downloads)
    for part in ("carried by no", "is off in", " sends "):
        assert not said(verdict, Severity.ERROR, part)
        assert not said(verdict, Severity.WARNING, part)
