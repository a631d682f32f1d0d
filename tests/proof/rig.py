"""The whole plant as processes: bridge, drives, owners, witnesses; and what an operator would do to it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Iterable
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from typing import Final

from tests.proof import machine
from tests.proof.block import BLOCK
from tests.proof.board import Board
from tests.proof.drives import (
    BRIDGE_SIDE,
    DRIVE_SIDE,
    DRIVES,
    PORTS,
    SERVED,
    SERVERS,
    SPOKEN,
    Drive,
    write_site,
)
from tests.proof.recovery import Recovery
from tests.proof.replays import Replays, replay_all
from tests.proof.waits import follow
from tests.proof.witness import Clock, Witness
from tests.support.process import REPOSITORY, Process, running

_FRESH_S: Final = 0.5
_LIMIT_S: Final = 120.0
_FRONT_ENDS_S: Final = 10.0
_HOUR_S: Final = 3600.0
BRIDGE_HEARTBEAT: Final = 0x77F
NMT: Final = 0x000
BRIDGE: Final = "bridge"
SIMULATION: Final = "drives"
_SERVES: Final = {"opcua": "INFO    OPC UA on", "zenoh": "INFO    zenoh on"}
FRONTS: Final = {protocol: f"{protocol}_front" for protocol in _SERVES if protocol in SERVED}
"""The process of each protocol that has one of its own."""
_MAIN_THREAD: Final = ("chrt", "--reset-on-fork", "--other", "0")
"""What it may do more than others is not handed on to what it starts."""
_LAST: Final = ("nice", "-n", "15")
_AHEAD: Final = -20
"""The bridge's main thread goes first once it serves, its front and zenoh's threads do not, as in
systemd/drivebridge.service; but not in the real-time class, which on one CPU would starve its clients."""
_DRIVES_AHEAD: Final = (*_MAIN_THREAD, "nice", "-n", "-5")
"""They react late where the machine is busy with other things; elsewhere they have a CPU of their own."""


class Stuck(Exception):
    """The plant does not do what the proof waits for."""


class NotStopped(Stuck):
    """Drives that a fault should have stopped go on."""


class Owner:
    """The owner of one protocol's drives: a process that can be stopped, killed and replaced."""

    def __init__(self, folder: Path, stack: ExitStack, protocol: str, board: Path, watched: Path) -> None:
        command = [sys.executable, "-m", "tests.proof.owner", protocol, str(board)]
        log = stack.enter_context((folder / f"owner_{protocol}.log").open("wb"))
        self._nursery = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, bufsize=1
        )
        stack.callback(self._end)
        self.protocol = protocol
        self._watched = watched
        self.pid = 0

    def wait_loaded(self) -> None:
        assert self._nursery.stdout
        if self._nursery.stdout.readline() != "loaded\n":
            raise Stuck(f"the owner of {self.protocol} has not come up")

    def start(self) -> None:
        assert self._nursery.stdin
        assert self._nursery.stdout
        self._nursery.stdin.write("\n")
        self.pid = int(self._nursery.stdout.readline())
        follow(self._watched, self.protocol, self.pid)

    def signal(self, number: signal.Signals) -> None:
        os.kill(self.pid, number)

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            self.signal(signal.SIGKILL)

    def _end(self) -> None:
        if self.pid:
            self.kill()
        self._nursery.kill()
        self._nursery.wait()


HOLD_S: Final = 3.0
"""How long the owners go on writing "run" after everything is back and their telegrams are taken: nothing may
start by that."""


class Rig:
    """Everything that runs; ``folder`` is the proof's own. The bridge alone is of the source ``tree``."""

    def __init__(self, folder: Path, stack: ExitStack, tree: Path = REPOSITORY) -> None:
        self.folder = folder
        self.tree = tree
        self.patience_s = 60.0
        """How long is waited for what has to come back."""
        self._stack = stack
        self._bridges = ExitStack()
        stack.enter_context(self._bridges)
        self.disk = machine.TinyDisk(folder / "disk")
        stack.callback(self.disk.close)
        self.gateway = machine.Gateway()
        self.clock = Clock()
        self.watched = folder / "watched"
        """What held bridge and drives up (``tests.proof.waits``)."""
        self.board = Board(folder / "board", len(DRIVES))
        self.bridge: Process | None = None
        self._fronts: tuple[int, ...] = ()
        self._starts = 0
        state, run, unused = self.disk.folder / "state", folder / "run", folder / "unused"
        self.other_nodes = [BLOCK.site(folder)]
        """Tables of nodes that are no drives, for the site file."""
        self._site = write_site(folder / "site.toml", BRIDGE_SIDE, state, run, others=self.other_nodes)
        self._drives = write_site(folder / "drives.toml", DRIVE_SIDE, unused, unused, others=self.other_nodes)
        self.worst_case_ms: dict[Drive, int] = {}
        """What the bridge publishes: its own bound, and that of a drive without a bridge."""
        self.worst_case_bridge_ms: dict[Drive, int] = {}
        self.intruder_ms = 0.0
        """Within which time the bridge answers an intruder, as ``drivebridge check`` says."""
        self.guests = ExitStack()
        """Whoever is there for one fault alone."""
        self.hours = -1
        """Which way the clock was stepped last."""
        self.noise_ms = 0.0
        self.hold_s = HOLD_S
        self.by_themselves = 0
        """Drives that stood still before a fault: what a slow machine has done."""
        self.excused: list[str] = []
        """Findings by yes or no that a slow machine may have brought about."""
        self.stopped_in_vain: list[str] = []
        """Drives that a fault stopped which did not concern them."""

    def replayed(self) -> Replays:
        """What comes of the recordings of its bridge."""
        return replay_all(self._site, self.disk.folder / "state", self.folder)

    @staticmethod
    def now() -> float:
        return time.monotonic()

    def start(self) -> None:
        self._stack.callback(self._restore)
        self._stack.callback(self.send_guests_away)
        self.gateway.open()
        rpdos = {can_id for drive in DRIVES for can_id in (drive.rpdo, drive.number_id)}
        self.told = Witness(BRIDGE_SIDE, sorted({NMT, *rpdos, BLOCK.rpdo, BRIDGE_HEARTBEAT}), self.clock)
        self.heard = Witness(BRIDGE_SIDE, _from_nodes(DRIVES), self.clock)
        self.said = Witness(DRIVE_SIDE, _from_nodes(DRIVES), self.clock)
        for witness in (self.told, self.heard, self.said):
            self._stack.callback(witness.close)
        self.watched.mkdir()
        watch = [sys.executable, "-m", "tests.proof.waits", str(self.watched)]
        watch += [BRIDGE, *FRONTS.values(), SIMULATION, *SPOKEN]
        self._stack.enter_context(running(self.folder, "watch", *watch))
        drives = [sys.executable, "-m", "bridge", "simulate", str(self._drives)]
        simulate = running(self.folder, "simulate", *_DRIVES_AHEAD, *drives)
        simulation = self._stack.enter_context(simulate)
        simulation.wait_output("simulating")
        follow(self.watched, SIMULATION, simulation.pid)
        self.owners = {
            protocol: Owner(self.folder, self._stack, protocol, self.folder / "board", self.watched)
            for protocol in SPOKEN
        }
        self.start_bridge()
        self._read_bounds()
        for owner in self.owners.values():
            owner.wait_loaded()
            owner.start()

    def start_bridge(self) -> None:
        """Start the service and wait until all it serves is there."""
        self._starts += 1
        name = f"run_{self._starts}"
        source = ("env", f"PYTHONPATH={self.tree}")
        command = [*source, *_MAIN_THREAD, sys.executable, "-m", "bridge", "run", str(self._site)]
        self.bridge = self._bridges.enter_context(running(self.disk.folder, name, *command))
        for protocol in FRONTS:
            self.bridge.wait_output(_SERVES[protocol], _LIMIT_S)
        with suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, self.bridge.pid, _AHEAD)
        follow(self.watched, BRIDGE, self.bridge.pid)
        self.follow_fronts()

    def follow_fronts(self) -> None:
        """They may be others."""
        fronts = {protocol: self.front(protocol) for protocol in FRONTS}
        self._fronts = tuple(fronts.values())
        for protocol, front in fronts.items():
            follow(self.watched, FRONTS[protocol], front)

    def another_bridge(self, site: Path) -> AbstractContextManager[Process]:
        """Beside the first one, on the same bus; without fronts, which know of no bus. On a box of its own it
        would take no time from anybody."""
        source = ("env", f"PYTHONPATH={self.tree}", *_LAST)
        command = (*source, sys.executable, "-m", "bridge", "run", str(site), "--role", "bus")
        return running(self.folder, "second", *command)

    def send_guests_away(self) -> None:
        self.guests.pop_all().close()

    def stand_still(self) -> float:
        """The bus process is stopped. Gives the time from which it does nothing: it may have had its turn
        while it was told so, and what it did there is none of the fault's."""
        assert self.bridge
        self.bridge.signal(signal.SIGSTOP)
        return time.monotonic()

    def kill_bridge(self) -> float:
        """The bus process dies; its fronts go with it."""
        assert self.bridge
        with suppress(OSError, Stuck):
            self._fronts = tuple(self.front(protocol) for protocol in FRONTS)
        self.bridge.popen.kill()
        now = time.monotonic()
        self.bridge.popen.wait()
        return now

    def renew_bridge(self) -> None:
        assert self.bridge
        log = self.bridge.log
        self._bridges.pop_all().close()
        kept = self.folder / log.name
        kept.write_bytes(log.read_bytes())
        log.unlink()
        # Their ports are free then.
        self.wait(lambda: all(map(_has_ended, self._fronts)), _FRONT_ENDS_S, "the fronts have ended")
        self._fronts = ()
        self.start_bridge()

    def front(self, protocol: str) -> int:
        """Process id of the front that serves it. Raises ``Stuck`` where there is none."""
        assert self.bridge
        children = Path(f"/proc/{self.bridge.pid}/task/{self.bridge.pid}/children")
        for child in children.read_text(encoding="ascii").split():
            command = Path(f"/proc/{child}/cmdline").read_bytes()
            if f"--role\0{protocol}\0".encode() in command:
                return int(child)
        raise Stuck(f"there is no front for {protocol}")

    def fronts_started(self, protocol: str) -> int:
        assert self.bridge
        return self.bridge.output().count(_SERVES[protocol])

    def _read_bounds(self) -> None:
        check = [sys.executable, "-m", "bridge", "check", "--json", str(self._site)]
        said = subprocess.run(check, capture_output=True, text=True, check=True)
        self.intruder_ms = float(json.loads(said.stdout)["intruders"][0]["within_ms"])
        script = str(REPOSITORY / "tests" / "peers" / "zenoh_ask.py")
        leaves = {"worst_case_stop_ms": self.worst_case_ms, "worst_case_bridge_ms": self.worst_case_bridge_ms}
        points = [f"drives/proof/{drive.path}/supervision/{leaf}=" for drive in DRIVES for leaf in leaves]
        command = [sys.executable, script, f"tcp/{SERVERS['zenoh']}:{PORTS['zenoh']}", *points]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        answers = iter(done.stdout.splitlines())
        for drive in DRIVES:
            for leaf, bounds in leaves.items():
                [answer] = json.loads(next(answers))
                if not answer["v"] and drive.reaction != "hold":
                    raise Stuck(f"{drive.path} has no {leaf}: {answer}")
                bounds[drive] = int(answer["v"] or 0)

    def _restore(self) -> None:
        """The machine as it was."""
        machine.restore_networks(list(SERVERS.values()))
        machine.set_link(BRIDGE_SIDE, up=True)
        self.gateway.close()
        if self.hours > 0:
            machine.step_clock(-_HOUR_S)

    def mend(self) -> None:
        """Whatever a round that failed has left: everything is as it was at the start."""
        for owner in self.owners.values():
            owner.kill()
        self.send_guests_away()
        machine.restore_networks(list(SERVERS.values()))
        machine.set_link(BRIDGE_SIDE, up=True)
        self.gateway.open()
        self.disk.empty()
        self.kill_bridge()
        for front in self._fronts:
            if not _has_ended(front):
                os.kill(front, signal.SIGKILL)
        machine.reset_nodes()
        self.renew_bridge()
        for owner in self.owners.values():
            owner.start()

    @property
    def frames_lost(self) -> int:
        return sum(witness.lost for witness in (self.told, self.heard, self.said))

    # what the drives do

    def moves(self, drive: Drive) -> bool:
        """It is enabled and turns, and its owner's telegrams are on the bus."""
        said, told = self.said.last(drive.tpdo), self.told.last(drive.rpdo)
        now = time.monotonic()
        if said is None or told is None or now - min(said.last, told.last) > _FRESH_S:
            return False
        return drive.enabled(said.data) and drive.speed(said.data) != 0 and drive.enabling(told.data)

    def says(self, drive: Drive) -> bool:
        """The bridge hears its process data."""
        said = self.heard.last(drive.tpdo)
        return said is not None and time.monotonic() - said.last <= _FRESH_S

    def talks(self, drive: Drive) -> bool:
        """Process data go both ways."""
        told = self.told.last(drive.rpdo)
        return self.says(drive) and told is not None and time.monotonic() - told.last <= _FRESH_S

    def wait(self, holds: Callable[[], bool], limit_s: float, what: str) -> float:
        """Until it holds; how long that took, in seconds."""
        begin = time.monotonic()
        while not holds():
            if time.monotonic() - begin > limit_s:
                raise Stuck(f"not within {limit_s:g} s: {what}")
            time.sleep(0.03)
        return time.monotonic() - begin

    def run_all(self, anew: Collection[Drive] = ()) -> None:
        """Acknowledge, make ready, enable, each drive by its owner, until all of them move; those of ``anew``
        also where they do."""
        going = [Recovery(self, drive, anew=drive in anew) for drive in DRIVES]
        end = time.monotonic() + 2 * self.patience_s
        while going:
            now = time.monotonic()
            going = [one for one in going if not one.step(now)]
            if now > end:
                raise Stuck("; ".join(str(one) for one in going))
            time.sleep(0.03)


def _has_ended(pid: int) -> bool:
    """One that nobody has waited for yet has no command line any more."""
    try:
        return not Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return True


def _from_nodes(drives: Iterable[Drive]) -> list[int]:
    nodes = {drive.node_id for drive in drives}
    tpdos = {drive.tpdo for drive in drives}
    return sorted(tpdos | {base + node for node in nodes for base in (0x080, 0x700)})
