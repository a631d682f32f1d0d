"""Downloads of a node count as what the site file's own keys say, the last of an object for all."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config.download import Download
from bridge.lint import Severity
from tests.support.lint_site import DICTIONARY, NORD, OTHER, TIMEOUT, judge, only


def configure(*entries: tuple[str, str, int]) -> str:
    """[[bus.node.configure]] tables: object, type and value."""
    return "".join(
        f'[[bus.node.configure]]\nobject = "{name}"\ntype = "{kind}"\nvalue = {value}\n'
        for name, kind, value in entries
    )


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
