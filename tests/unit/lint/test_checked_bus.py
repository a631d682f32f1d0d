"""A bus as the linter sees it: site file before download before factory, and how often a PDO comes."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config import load_site
from bridge.config.download import Download
from bridge.lint.checked_bus import CheckedBus, CheckedPdo, view_bus
from tests.support import sites


def pdo(kind: int = 255, **more: float) -> CheckedPdo:
    return CheckedPdo("TPDO1", (), False, transmission_type=kind, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("view", "longest", "shortest"),
    [
        (pdo(1), 0.01, 0.01),
        (pdo(7), 0.07, 0.07),
        (pdo(0), None, 0.01),
        (pdo(255, event_ms=100), 0.1, 0.1),
        (pdo(254, event_ms=100, inhibit_ms=5.0), 0.1, 0.005),
        (pdo(255), None, None),
        (pdo(255, inhibit_ms=5.0), None, 0.005),
        (pdo(253, rtr_poll_ms=50), 0.05, 0.05),
        (pdo(253), None, None),
    ],
)
def test_how_often_a_pdo_comes(view: CheckedPdo, longest: float | None, shortest: float | None) -> None:
    """CiA 301 §7.5.2.37, with SYNC every 10 ms."""
    assert view.period_s(0.01) == (pytest.approx(longest) if longest else None)
    assert view.shortest_s(0.01) == (pytest.approx(shortest) if shortest else None)


def test_without_sync_nothing_synchronous_is_regular() -> None:
    assert pdo(1).period_s(0.0) is None
    assert pdo(1).shortest_s(0.0) is None


def view(folder: Path, drive: str = "", *downloads: Download) -> CheckedBus:
    path = sites.write(folder, sites.bus(sites.node(sites.drive("fu1", "none", 0, drive))))
    site = load_site(path)
    families = {sites.FAMILY: sites.family(sites.FAMILY)}
    return view_bus(site.bus[0], ("bus", 0), families, {}, {"conveyor": downloads})


def rpdo(bus: CheckedBus) -> CheckedPdo:
    return bus.nodes[0].drives[0].rpdos[0]


def number(value: int) -> bytes:
    return value.to_bytes(4, "little")


def test_identifiers_are_those_of_the_mapping_with_the_node_added(tmp_path: Path) -> None:
    found = rpdo(view(tmp_path))
    assert (found.cob_id, found.receives, found.sent, found.cob_id_key) == (0x205, True, True, None)


def test_what_is_downloaded_counts_before_them(tmp_path: Path) -> None:
    assert rpdo(view(tmp_path, "", Download(0x1400, 1, number(0x301)))).cob_id == 0x301
    assert not rpdo(view(tmp_path, "", Download(0x1400, 1, number(0x8000_0205)))).enabled


def test_the_site_file_counts_before_all_with_its_key(tmp_path: Path) -> None:
    bus = view(
        tmp_path, "rpdo = { cob_id = 0x2A5, transmission_type = 1 }", Download(0x1400, 1, number(0x301))
    )
    found = rpdo(bus)
    assert (found.cob_id, found.transmission_type, found.is_synchronous) == (0x2A5, 1, True)
    assert found.cob_id_key == ("bus", 0, "node", 0, "drive", 0, "rpdo", "cob_id")


def test_a_node_has_also_the_pdos_of_drives_that_the_site_leaves_out(tmp_path: Path) -> None:
    (node,) = view(tmp_path).nodes
    own = {one.name for one in (*node.drives[0].rpdos, *node.drives[0].tpdos)}
    assert own < {one.name for one in node.pdos}
    assert node.emcy_id == 0x085
