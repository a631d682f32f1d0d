"""Rig of the fuzzers: the bridge as its user runs it, on simulated drives, with a good client per protocol.

The good clients own fu1 (Modbus), fu2 (OPC UA) and fu3 (zenoh) and keep them turning. fu4 may be leased by
whoever asks, the drive of the node ``spare`` belongs to whoever comes first by Modbus. The other nodes have
one of each family; nobody may move them.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.support import sites
from tests.support.passwords import cheap_hash
from tests.support.process import REPOSITORY, Process, free_port, running, until

STRANGER: Final = "127.0.0.9"
"""Address of the thrower, as far as a protocol can tell."""
GOOD, PASSWORD = "good", "good-password"
ADMIN: Final = "admin"
"""A user with the same password, whom the thrower has."""
APPLICATION_URI: Final = "urn:fuzz:drivebridge"
GOOD_NODE: Final = 5
GOOD_RPDOS: Final = {0x205: "fu1", 0x305: "fu2", 0x405: "fu3"}
SPARE: Final = 9
SPARE_NODES: Final = (6, 7, 8, SPARE)
_NODES: Final = 1 + len(SPARE_NODES)
CONTROL_WORD, SETPOINT = 0x047F, 0x1000
_TIMEOUT_MS: Final = 30_000
"""A busy machine is no fault of the bridge: what its clients wait for is measured, not found by a trip."""
_READY_S: Final = 90.0


@dataclass(slots=True)
class Rig:
    """A running bridge. ``folder`` has its log, its state and what the good clients noted."""

    folder: Path
    process: Process
    good: Process
    modbus: int
    opcua: int
    zenoh: int
    named_words: int = 0
    """Words of the distinct keys that strangers have named by zenoh, which keeps them."""

    @property
    def wire(self) -> Path:
        return self.folder / "wire"

    @property
    def words(self) -> Path:
        """Changes of RPDOs on the bus."""
        return self.folder / "words"

    @property
    def exchanges(self) -> Path:
        """File of the good clients' requests, and how they ended."""
        return self.folder / "exchanges"

    @property
    def audit(self) -> Path:
        return self.folder / "state" / "audit.jsonl"

    def fronts(self) -> list[int]:
        """Without a fork of the bus process, which writes a checkpoint of the recorder and ends."""
        own = command_line(self.process.pid)
        return [pid for pid in children(self.process.pid) if command_line(pid) not in (own, b"")]


def command_line(pid: int) -> bytes:
    """Empty where there is no such process any more."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def children(pid: int) -> list[int]:
    found = subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False)
    return [int(child) for child in found.stdout.split()]


def _drive(slot: str, control: str, unit: int, more: str = "stop_by_anyone = false") -> str:
    return sites.drive(slot, control, _TIMEOUT_MS, f"unit_id = {unit}\n{more}\n")


def _bus() -> str:
    good = [
        _drive(slot, control, unit, f"stop_by_anyone = false\n{sites.SCALED}")
        for unit, (slot, control) in enumerate((("fu1", "modbus"), ("fu2", "opcua"), ("fu3", "zenoh")), 1)
    ]
    free = _drive("fu4", "lease", 4, sites.SCALED)
    often = "tpdo = { event_ms = 100 }"
    slow = "supervision_ms = 1000"
    nodes = (
        sites.node(*good, free, node_id=GOOD_NODE, more=slow),
        sites.node(
            _drive("drive", "none", 5, often), name="pump", node_id=6, mapping="lenze/8400-motec", more=slow
        ),
        sites.node(
            _drive("axis1", "none", 6, often),
            name="lift",
            node_id=7,
            mapping="stoeber/5000",
            more=f'supervision = "guarding"\n{slow}',
        ),
        sites.node(
            _drive("drive", "none", 7, ""), name="fan", node_id=8, mapping="cia402/velocity", more=slow
        ),
        sites.node(_drive("fu1", "modbus", 8, sites.SCALED), name="spare", node_id=SPARE, more=slow),
    )
    return sites.bus(*nodes, more='deadman_ms = 2000\nsync_period_ms = 20\non_intruder = "report"')


def write_site(folder: Path, modbus: int, opcua: int, zenoh: int) -> Path:
    """The site as ``folder/site.toml``."""
    line = cheap_hash(PASSWORD)
    users = "".join(
        f'[[opcua.user]]\nname = "{name}"\nrole = "{role}"\npassword_hash = "{line}"\n'
        for name, role in ((GOOD, "operator"), (ADMIN, "admin"))
    )
    # The administrator who is thrown about may empty the trust list, and goes on.
    opcua_table = f'{sites.opcua(opcua)}application_uri = "{APPLICATION_URI}"\ntrust = "anybody"\n'
    zenoh_table = f"{sites.zenoh(zenoh)}accept_put = true\n"
    return sites.write(folder, _bus(), sites.modbus(modbus), opcua_table, users, zenoh_table)


def write_black_box(folder: Path) -> None:
    """A trip of fu1 that was before the bridge began."""
    path = folder / "state" / "opcua" / "black_box" / "conveyor" / "fu1" / "2026-01-01T12-00-00.000000Z.csv"
    path.parent.mkdir(parents=True)
    path.write_text("time,s,actual/frequency\r\n" + "2026-01-01T12:00:00Z,0.0,25.0\r\n" * 200)


@contextmanager
def running_rig(folder: Path) -> Iterator[Rig]:
    """The bridge with all its nodes operational and the good clients' drives turning."""
    ports = free_port(), free_port(), free_port()
    path = write_site(folder, *ports)
    write_black_box(folder)
    here = REPOSITORY / "tests" / "fuzz"
    bridge = [sys.executable, str(here / "wired_bridge.py"), str(folder), "run", str(path)]
    good = [sys.executable, str(here / "good.py"), str(folder / "exchanges"), *map(str, ports)]
    with running(folder, "bridge", *bridge, notify=True) as process:
        process.wait_ready(_READY_S)
        until(lambda: process.output().count(": node operational") >= _NODES, _READY_S, "all nodes operate")
        with running(folder, "good", *good) as clients:
            clients.wait_output("running", _READY_S)
            yield Rig(folder, process, clients, *ports)
