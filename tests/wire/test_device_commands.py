"""The commands on a bus, tried on an encoder and an I/O block that are simulated in this process."""

from __future__ import annotations

import asyncio
import json
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.can import Bus
from bridge.can.virtual import VirtualWire
from bridge.cli import bus_runner as cli_bus
from bridge.cli import drop_test_command
from bridge.cli.app import make_app
from bridge.sim.catalogue import simulate_description
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.generic.generic_node import GenericNode
from bridge.sim.runner import Simulation
from tests.support.devices import DEVICES, description_of

RUN = CliRunner()
WATCHING = 'own_timeout_ms = 400\nenforce = true\n[bus.node.outputs]\ncontrol = "modbus"\n'
OWNED = f"{WATCHING}fieldbus_timeout_ms = 300\n"


class Hall:
    """An encoder, node 20, and an I/O block, node 21, on a bus that every command finds as can0."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.site = folder / "hall.toml"
        self.shaft, self.io = (self._node(file, at) for file, at in (("encoder.eds", 20), ("io16.eds", 21)))
        for node in (self.shaft, self.io):
            node.start(time.monotonic())
            # It stays switched on from one command to the next.
            monkeypatch.setattr(node, "start", lambda now: None)
        monkeypatch.setattr(cli_bus, "open_bus", lambda *_, **__: self._bus(monkeypatch))
        monkeypatch.setattr(drop_test_command, "make_bus", lambda _: self._bus(monkeypatch))

    @staticmethod
    def _node(file: str, node_id: int) -> GenericNode:
        node: SimulatedDevice = simulate_description(description_of(file), node_id)
        assert isinstance(node, GenericNode)
        return node

    def _bus(self, monkeypatch: pytest.MonkeyPatch) -> Bus:
        """One end of a wire whose other end is played while this one is open."""
        wire = VirtualWire()
        end, simulation = wire.end("can0"), Simulation(wire.end("hall"), [self.shaft, self.io])
        open_end, close_end = end.open, end.close
        playing: list[asyncio.Task[None]] = []

        def opened(wake: Callable[[], None]) -> None:
            open_end(wake)
            simulation.open()
            playing.append(asyncio.get_running_loop().create_task(simulation.run()))

        def closed() -> None:
            for task in playing:
                task.cancel()
            close_end()

        monkeypatch.setattr(end, "open", opened)
        monkeypatch.setattr(end, "close", closed)
        return end

    def said(self, *arguments: str, code: int = 0) -> str:
        """What a command says on standard output."""
        words = [str(self.site) if one == "SITE" else one for one in arguments]
        result = RUN.invoke(make_app(words[0]), words)
        assert result.exit_code == code, f"{result.output}{result.exception!r}"
        return result.stdout


@pytest.fixture
def hall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hall]:
    shutil.copytree(DEVICES, tmp_path / "eds")
    hall = Hall(tmp_path, monkeypatch)
    found = ("--interface", "socketcan", "--channel", "can0", "--bitrate", "250000")
    listed = hall.said("scan", *found, "--write", str(hall.site), "--eds", str(tmp_path / "eds"))
    assert "Shaft 25" in listed
    text = hall.site.read_text(encoding="utf-8")
    hall.site.write_text(text.replace('"state"', f'"{tmp_path}/state"'), encoding="utf-8")
    yield hall


def own_outputs(hall: Hall) -> None:
    text = hall.site.read_text(encoding="utf-8")
    mapping = 'mapping = "eds:eds/io16.eds"\n'
    assert mapping in text
    hall.site.write_text(text.replace(mapping, f"{mapping}{OWNED}"), encoding="utf-8")


def test_what_a_scan_has_written_is_without_faults(hall: Hall) -> None:
    assert hall.said("check", "SITE").endswith(": 2 devices on 1 bus, no faults\n")
    own_outputs(hall)
    assert "io_16: dead controller: " in hall.said("check", "SITE")


def test_parameters_are_read_written_backed_up_and_restored(hall: Hall, tmp_path: Path) -> None:
    assert hall.said("parameters", "read", "SITE", "shaft_25", "6001", "6002").split("\n")[:2] == [
        "6001 = 8192",
        "6002 = 33554432",
    ]
    hall.said("parameters", "write", "SITE", "shaft_25", "6003", "100", "--yes")
    assert hall.shaft.value((0x6003, 0)) == 100
    file = str(tmp_path / "shaft.toml")
    assert "parameters of shaft_25 in" in hall.said("parameters", "backup", "SITE", "shaft_25", file)
    hall.said("parameters", "write", "SITE", "shaft_25", "6003", "7", "--yes")
    assert "6003" in hall.said("parameters", "compare", "SITE", "shaft_25", file, code=1)
    hall.said("parameters", "restore", "SITE", "shaft_25", file, "--yes")
    assert hall.shaft.value((0x6003, 0)) == 100
    hall.said("parameters", "compare", "SITE", "shaft_25", file)


@pytest.mark.landing
def test_they_are_looked_at_like_any_node(hall: Hall) -> None:
    assert "IO 16" in hall.said("sdo", "read", "SITE", "io_16", "1008")
    hall.said("nmt", "SITE", "start", "io_16")
    assert hall.io.slave.state is SlaveState.OPERATIONAL
    frames = [
        json.loads(line)
        for line in hall.said(
            "monitor", "SITE", "--node", "io_16", "--kind", "pdo", "--count", "2", "--json"
        ).splitlines()
    ]
    assert {"digital_inputs_1_to_8", "analogue_input_1"} & {name for one in frames for name in one["values"]}


@pytest.mark.landing
def test_they_are_tried_for_what_cia_301_asks(hall: Hall) -> None:
    facts = json.loads(hall.said("conformance", "SITE", "shaft_25", "--yes", "--json"))
    assert facts["ok"], facts


@pytest.mark.landing
def test_outputs_are_audited_and_the_node_proves_that_it_notices(hall: Hall) -> None:
    own_outputs(hall)
    assert "io_16 would keep its outputs" in hall.said("audit", "SITE", code=1)
    report = json.loads(hall.said("drop-test", "SITE", "io_16", "--yes-i-am-at-the-machine", "--json"))
    assert report["ok"], report
    (outcome,) = report["drives"]
    assert 300 < (outcome["noticed_ms"] or outcome["reacted_ms"]) < 500
    assert "io_16" in hall.said("audit", "SITE"), "the boot-up has written what was to be enforced"
