"""The drives as devices of published models: a client that knows nothing but these commands all families."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support import sites
from tests.support.process import drivebridge, free_port, peer_called

TIMEOUT_MS = 5000
"""Longer than a busy machine keeps the client from its next write."""
SITE = sites.bus(
    sites.node(sites.drive("fu1", "opcua", TIMEOUT_MS), more="own_timeout_ms = 1000\nenforce = true"),
    sites.node(
        sites.drive(
            "drive", "opcua", TIMEOUT_MS, "parameters = { C00011 = 1500.0 }\ntpdo = { event_ms = 100 }"
        ),
        name="pump",
        node_id=6,
        mapping="lenze/8400-motec",
        more="own_timeout_ms = 1000\nenforce = true",
    ),
    sites.node(
        sites.drive("axis1", "opcua", TIMEOUT_MS, "parameters = { C01 = 3000.0 }\ntpdo = { event_ms = 100 }"),
        name="lift",
        node_id=7,
        mapping="stoeber/5000",
        more='supervision = "guarding"',
    ),
    sites.node(
        sites.drive("drive", "opcua", TIMEOUT_MS, sites.ACCEPTED),
        name="fan",
        node_id=8,
        mapping="cia402/velocity",
    ),
    more=sites.BESIDE_A_BROWSER,
)


def test_one_client_that_knows_powertrain_alone_starts_runs_and_stops_all_four_families(
    tmp_path: Path,
) -> None:
    port = free_port()
    site = sites.write(tmp_path, SITE, sites.opcua(port))
    with drivebridge(tmp_path, "bridge", "run", str(site), notify=True) as bridge:
        bridge.wait_ready()
        done = peer_called("powertrain", str(port))
    assert not done.returncode, done.stderr
    found = {one["drive"]: one for one in map(json.loads, done.stdout.splitlines())}
    assert {name: (one["type"], one["unit"]) for name, one in found.items()} == {
        "conveyor/fu1": ("PtAssetFrequencyConverterType", "Hz"),
        "pump/drive": ("PtAssetFrequencyConverterType", "1/min"),
        "lift/drive": ("PtAssetVariableSpeedDriveType", "1/min"),
        "fan/drive": ("PtAssetDriveType", "1/min"),
    }
    for one in found.values():
        assert one["ran_at"] == pytest.approx(one["wanted"], rel=0.05)
        assert one["health"] == 0
    assert found["conveyor/fu1"]["plate"]["Manufacturer"] == "Getriebebau NORD"
    assert found["fan/drive"]["plate"]["Manufacturer"] is None, "the profile is anybody's"
