"""Downloaded times, identifiers and transmission types are judged as those of the site file."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity
from tests.support.lint_site import FAMILY, NORD, TIMEOUT, findings, judge, only


def configure(*entries: tuple[str, str, int]) -> str:
    """[[bus.node.configure]] tables: object, type and value."""
    return "".join(
        f'[[bus.node.configure]]\nobject = "{name}"\ntype = "{kind}"\nvalue = {value}\n'
        for name, kind, value in entries
    )


@pytest.mark.parametrize(
    ("bus", "value", "text"),
    [
        ("", 0x7F_0064, "100 ms, and the bridge's heartbeat comes every 100 ms"),
        ("heartbeat_ms = 0", 0x7F_0064, "no heartbeat of node 127"),
        ("", 0x09_0064, "no heartbeat of node 9"),
    ],
)
def test_a_node_that_waits_for_a_heartbeat_in_vain(tmp_path: Path, bus: str, value: int, text: str) -> None:
    """1016h: node id in bits 16…22, time in ms below."""
    verdict = judge(tmp_path, bus=bus, node=configure(("1016:01", "uint32", value)))
    assert text in only(verdict, Severity.WARNING)


@pytest.mark.parametrize("value", [0x7F_00C8, 0x00_0000, 0x7F_0000])
def test_a_node_that_waits_long_enough_or_not_at_all(tmp_path: Path, value: int) -> None:
    assert judge(tmp_path, node=configure(("1016:01", "uint32", value))).findings == ()


@pytest.mark.parametrize("cob_id", [0x601, 0x5FF, 0x580])
def test_a_pdo_on_an_identifier_that_is_not_for_pdos(tmp_path: Path, cob_id: int) -> None:
    found = only(judge(tmp_path, drive=f"{TIMEOUT}\ntpdo = {{ cob_id = {cob_id} }}"), Severity.ERROR)
    assert f"TPDO1 cannot have COB-ID {cob_id:X}h" in found
    assert "drive[0].tpdo.cob_id" in found


@pytest.mark.parametrize("cob_id", [0x601, 0x2000_0185])
def test_a_downloaded_one_neither(tmp_path: Path, cob_id: int) -> None:
    """Bit 29 is a 29-bit identifier: the bridge uses those with 11 bits."""
    found = only(judge(tmp_path, node=configure(("1800:01", "uint32", cob_id))), Severity.ERROR)
    assert "TPDO1 cannot have COB-ID" in found
    assert ".configure[0]" in found


@pytest.mark.parametrize("pdo", ["rpdo", "tpdo"])
@pytest.mark.parametrize("kind", [241, 251])
def test_reserved_transmission_types(tmp_path: Path, pdo: str, kind: int) -> None:
    drive = f"{TIMEOUT}\n{pdo} = {{ transmission_type = {kind} }}"
    [found] = findings(judge(tmp_path, drive=drive), Severity.ERROR)
    assert f"transmission_type: {pdo.upper()}1 cannot have type {kind}: 241…251 are reserved" in found


@pytest.mark.parametrize("kind", [252, 253])
def test_an_rpdo_is_not_asked_for(tmp_path: Path, kind: int) -> None:
    drive = f"{TIMEOUT}\nrpdo = {{ transmission_type = {kind} }}"
    found = only(judge(tmp_path, drive=drive), Severity.ERROR)
    assert f"RPDO1 cannot have type {kind}: 252 and 253 are for TPDOs sent on request" in found


def test_a_type_that_the_family_does_not_have(tmp_path: Path) -> None:
    """BU 2500 §6.5.6: 252 and 253 are reserved."""
    assert FAMILY.process.forbidden_types == [252, 253]
    drive = f"{TIMEOUT}\nrtr_poll_ms = 20\ntpdo = {{ transmission_type = 253 }}"
    found = only(judge(tmp_path, drive=drive), Severity.ERROR)
    assert "TPDO1 cannot have type 253: SK TU4-CAO does not have 252, 253" in found


def test_a_downloaded_type_counts_too(tmp_path: Path) -> None:
    [found] = findings(judge(tmp_path, node=configure(("1800:02", "uint8", 245))), Severity.ERROR)
    assert "configure[0]" in found
    assert "cannot have type 245" in found


def test_what_the_factory_has_is_its_own_affair(tmp_path: Path) -> None:
    process = FAMILY.process.model_copy(update={"forbidden_types": [255]})
    family = FAMILY.model_copy(update={"process": process})
    assert judge(tmp_path, families={NORD: family}).findings == ()


def test_one_lost_frame_must_not_lose_a_node(tmp_path: Path) -> None:
    found = only(judge(tmp_path, node='supervision = "guarding"\nlife_time_factor = 1'), Severity.WARNING)
    assert "life_time_factor: is 1: a single lost frame counts as a lost node" in found
    assert judge(tmp_path, node='supervision = "guarding"\nlife_time_factor = 2').findings == ()
    assert findings(judge(tmp_path, node="life_time_factor = 1"), Severity.WARNING) == []
