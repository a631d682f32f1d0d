"""What is downloaded to a node counts for the linter as what the site file's own keys say."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config.download import Download
from bridge.lint import Severity
from tests.support.lint_site import DICTIONARY, FAMILY, NORD, OTHER, TIMEOUT, findings, judge, only


def configure(*entries: tuple[str, str, int]) -> str:
    """[[bus.node.configure]] tables: object, type and value."""
    return "".join(
        f'[[bus.node.configure]]\nobject = "{name}"\ntype = "{kind}"\nvalue = {value}\n'
        for name, kind, value in entries
    )


# COB-IDs and mappings


def test_a_downloaded_cob_id_collides(tmp_path: Path) -> None:
    """40000206h is 206h, the RPDO1 of node 6."""
    node = configure(("1800:01", "uint32", 0x4000_0206))
    verdict = judge(tmp_path, node=node, more=OTHER.format(id=6, family=NORD))
    found = only(verdict, Severity.ERROR)
    assert "RPDO1 of pump has COB-ID 206h, which is TPDO1 of conveyor's" in found


def test_a_collision_is_named_where_it_was_downloaded(tmp_path: Path) -> None:
    node = configure(("2097:01", "uint16", 150), ("1800:01", "uint32", 0x285))
    assert "bus[0].node[0].configure[1]" in only(judge(tmp_path, node=node), Severity.ERROR)


def test_a_drives_pdo_that_is_downloaded_off(tmp_path: Path) -> None:
    node = configure(("1800:01", "uint32", 0xC000_0185))
    assert "TPDO1 is off: conveyor/fu1 has no process data" in only(
        judge(tmp_path, node=node), Severity.ERROR
    )
    # What the site file's own table says comes after the configuration.
    assert judge(tmp_path, node=node, drive=f"{TIMEOUT}\ntpdo = {{ enable = true }}").of(Severity.ERROR) == ()


def test_a_pdo_that_is_downloaded_on_counts(tmp_path: Path) -> None:
    """NORD's RPDO5 is off at factory; on, and on node 6's TPDO1, it destroys frames."""
    node = configure(("1404:01", "uint32", 0x186))
    verdict = judge(tmp_path, node=node, more=OTHER.format(id=6, family=NORD))
    assert "COB-ID 186h, which is RPDO5 of conveyor's" in only(verdict, Severity.ERROR)


def test_a_pdo_that_nobody_has_described_counts(tmp_path: Path) -> None:
    verdict = judge(
        tmp_path,
        dictionary=None,
        more=OTHER.format(id=6, family=NORD),
        downloads=(Download(0x1808, 1, (0x186).to_bytes(4, "little")),),
    )
    found = only(verdict, Severity.ERROR)
    assert "COB-ID 186h, which is TPDO9 of conveyor's" in found


@pytest.mark.parametrize("dictionary", [True, False])
@pytest.mark.parametrize(
    ("entries", "length"),
    [
        ((("1600:00", "uint8", 2),), 4),
        ((("1600:01", "uint32", 0x3000_0108),), 7),
        ((("1600:00", "uint8", 1), ("1600:01", "uint32", 0x3000_0120)), 4),
    ],
)
def test_a_downloaded_mapping_has_its_length(
    tmp_path: Path, entries: tuple[tuple[str, str, int], ...], length: int, dictionary: bool
) -> None:
    verdict = judge(tmp_path, node=configure(*entries), dictionary=DICTIONARY if dictionary else None)
    assert f"RPDO1 has {length} bytes; SK TU4-CAO evaluates only 8" in only(verdict, Severity.ERROR)


def test_of_an_object_that_is_downloaded_twice_the_last_counts(tmp_path: Path) -> None:
    node = configure(("1600:00", "uint8", 2), ("1600:00", "uint8", 4))
    assert judge(tmp_path, node=node).findings == ()


# what the bridge sets itself


@pytest.mark.parametrize(
    ("node", "entry", "text"),
    [
        ("", ("1017:00", "uint16", 0), "1017h:00 = 0, and the bridge sets it to 66"),
        ("", ("1017:00", "uint16", 100), "1017h:00 = 100, and the bridge sets it to 66"),
        ("", ("100C:00", "uint16", 100), "100Ch:00 = 100, and the bridge sets it to 0"),
        ("", ("100D:00", "uint8", 3), "100Dh:00 = 3, and the bridge sets it to 0"),
        ('supervision = "guarding"', ("1017:00", "uint16", 66), "1017h:00 = 66, and the bridge sets it to 0"),
        ('supervision = "guarding"', ("100D:00", "uint8", 2), "100Dh:00 = 2, and the bridge sets it to 3"),
    ],
)
def test_a_download_against_the_bridges_own_settings(
    tmp_path: Path, node: str, entry: tuple[str, str, int], text: str
) -> None:
    found = only(judge(tmp_path, node=f"{node}\n{configure(entry)}"), Severity.WARNING)
    assert text in found
    assert ".configure[0]" in found


def test_a_download_that_agrees_is_no_contradiction(tmp_path: Path) -> None:
    assert judge(tmp_path, node=configure(("1017:00", "uint16", 66))).findings == ()


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


@pytest.mark.parametrize(
    ("entry", "drive", "text"),
    [
        (("1800:05", "uint16", 100), "tpdo = { event_ms = 50 }", "1800h:05 = 100"),
        (("1800:02", "uint8", 1), "tpdo = { transmission_type = 254 }", "1800h:02 = 1"),
        (("1800:01", "uint32", 0x4000_0286), "tpdo = { cob_id = 0x186 }", "1800h:01 = 286h"),
    ],
)
def test_a_download_against_the_site_files_own_pdo(
    tmp_path: Path, entry: tuple[str, str, int], drive: str, text: str
) -> None:
    verdict = judge(tmp_path, node=configure(entry), drive=f"{TIMEOUT}\n{drive}")
    assert f"{text}, and the bridge sets it to" in only(verdict, Severity.WARNING)


# PDO settings that no device can have


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


# guarding


def test_one_lost_frame_must_not_lose_a_node(tmp_path: Path) -> None:
    found = only(judge(tmp_path, node='supervision = "guarding"\nlife_time_factor = 1'), Severity.WARNING)
    assert "life_time_factor: is 1: a single lost frame counts as a lost node" in found
    assert judge(tmp_path, node='supervision = "guarding"\nlife_time_factor = 2').findings == ()
    assert findings(judge(tmp_path, node="life_time_factor = 1"), Severity.WARNING) == []
