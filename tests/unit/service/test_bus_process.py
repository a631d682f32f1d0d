"""A bridge that another one keeps passive says so at its end: it stops nothing."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import pytest

from bridge.can.virtual import VirtualWire
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from tests.support import sites


@pytest.mark.parametrize("is_passive", [True, False])
async def test_what_it_says_when_it_ends(
    tmp_path: Path, is_passive: bool, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = sites.node(sites.drive("fu1", "modbus", 20_000))
    path = sites.write(tmp_path, sites.bus(node), sites.modbus())
    wire = VirtualWire()
    service = BusProcess(load_project(path), lambda table: wire.end(table.name), fronts=())
    [network] = service._networks
    monkeypatch.setattr(type(network.mastership), "is_passive", property(lambda mastership: is_passive))
    with caplog.at_level(logging.INFO):
        await asyncio.wait_for(service._stop(), 10)
    said = [record.getMessage() for record in caplog.records]
    assert ("stopping all drives" in said) is not is_passive
    assert ("passive on can0: another bridge is in charge, nothing is sent there" in said) is is_passive
