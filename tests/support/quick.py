"""Many small slaves on one network, on a virtual clock: no process data, but NMT, SDO and heartbeat."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from bridge.can.interface import BusStatus
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from bridge.catalogue import Catalogue
from bridge.command import Action, Event, Identity, Outcome, Plant, Request, Role, Source, command_of
from bridge.config import Site, load_site
from bridge.mapping import load_family
from bridge.master.line import Repeated
from bridge.master.network import Network
from bridge.master.standby import Standby
from bridge.node.node_core import NodeCore

NORD = load_family("nord/sk-tu4-cao")
MAPPING = "nord/sk-tu4-cao"
PRE_OPERATIONAL, OPERATIONAL, STOPPED = 0x7F, 0x05, 0x04
_AFTER = {0x01: OPERATIONAL, 0x02: STOPPED, 0x80: PRE_OPERATIONAL, 0x81: 0, 0x82: 0}
_MISSING = 0x0602_0000
ENGINEER = Identity(Source.LOCAL, "test", Role.ENGINEER)


class QuickNode:
    """``present`` is its plug, ``delay_s`` how long it takes for an SDO answer. What it does not have it
    aborts: the master then takes the mapping's word."""

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.present = True
        self.state = PRE_OPERATIONAL
        self.objects = {(0x1000, 0): bytes(4), (0x1017, 0): bytes(2)}
        self.writes: list[tuple[int, int, bytes]] = []
        self.refuses: set[int] = set()
        """Indices that cannot be written."""
        self.toggle = 0
        self.outbox: list[Frame] = []
        self.heartbeat_at = float("inf")
        self.delay_s = 0.0
        self.now = 0.0
        self._late: deque[tuple[float, Frame]] = deque()

    def start(self, now: float) -> None:
        """Power on."""
        self.state = PRE_OPERATIONAL
        self.toggle = 0
        self.objects[0x1017, 0] = bytes(2)
        self.heartbeat_at = float("inf")
        self.outbox.append(Frame(0x700 + self.node_id, b"\0"))

    @property
    def period_s(self) -> float:
        return int.from_bytes(self.objects[0x1017, 0], "little") / 1000

    @property
    def next_at(self) -> float:
        """Time at which it has something to send."""
        return min(self.heartbeat_at, self._late[0][0] if self._late else float("inf"))

    def on_time(self, now: float) -> None:
        self.now = now
        while self._late and self._late[0][0] <= now:
            answer = self._late.popleft()[1]
            if self.state != STOPPED:
                self.outbox.append(answer)
        if now >= self.heartbeat_at:
            self.heartbeat_at = now + self.period_s
            self.outbox.append(Frame(0x700 + self.node_id, bytes((self.state,))))

    def on_frame(self, frame: Frame, now: float) -> None:
        self.now = now
        if frame.can_id == 0 and len(frame.data) == 2 and frame.data[1] in (0, self.node_id):
            self.state = _AFTER.get(frame.data[0], self.state)
            if self.state == 0:
                self.start(now)
        elif frame.can_id == 0x700 + self.node_id | REMOTE:
            self.outbox.append(Frame(0x700 + self.node_id, bytes((self.state | self.toggle,))))
            self.toggle ^= 0x80
        elif frame.can_id == 0x600 + self.node_id and self.state != STOPPED:
            self._on_sdo(frame.data, now)

    def _on_sdo(self, data: bytes, now: float) -> None:
        command, index, sub = struct.unpack_from("<BHB", data)
        head = struct.pack("<HB", index, sub)
        if command == 0x40:
            value = self.objects.get((index, sub))
            if value is None:
                self._abort(index, sub, _MISSING)
            else:
                self._answer(bytes((0x43 | (4 - len(value)) << 2,)) + head + value.ljust(4, b"\0"))
        elif index in self.refuses:
            self._answer(b"\x80" + head + struct.pack("<I", _MISSING))
        elif command & 0xE3 == 0x23:
            size = 4 - (command >> 2 & 3)
            value = data[4 : 4 + size]
            self.writes.append((index, sub, value))
            self.objects[index, sub] = value
            if index == 0x1017:
                self.heartbeat_at = now + self.period_s if any(value) else float("inf")
            self._answer(b"\x60" + head + bytes(4))

    def _abort(self, index: int, sub: int, code: int) -> None:
        self._answer(struct.pack("<BHBI", 0x80, index, sub, code))

    def _answer(self, data: bytes) -> None:
        answer = Frame(0x580 + self.node_id, data)
        if self.delay_s:
            self._late.append((self.now + self.delay_s, answer))
        else:
            self.outbox.append(answer)


def quick_site(
    folder: Path, nodes: Sequence[str] | int, *, bus: str = "", common: str = "supervision_ms = 300"
) -> Site:
    """A site with node 1…n; each of ``nodes`` has further keys of that node."""
    lines = ['[site]\nname = "quick"\n[[bus]]\nname = "can0"\ninterface = "virtual"', bus]
    further = [""] * nodes if isinstance(nodes, int) else nodes
    for node_id, more in enumerate(further, 1):
        lines.append(f'[[bus.node]]\nname = "n{node_id}"\nid = {node_id}\nmapping = "{MAPPING}"')
        lines += [common, more, '[[bus.node.drive]]\nslot = "fu1"']
    path = folder / "site.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return load_site(path)


class Quick:
    """``log`` has what the master sent. ``lose`` says which frames of the nodes do not arrive."""

    def __init__(self, site: Site) -> None:
        self.now = 1000.0
        self.log: list[Frame] = []
        self.events: list[Event] = []
        # The manual's family leaves node ids above 63 out; a bus has 127.
        self.plant = Plant(Catalogue.of(site, {MAPPING: NORD}), "0", self.now)
        self.plant.on_event(self.events.append)
        # These tests begin where the bridge has listened already.
        self.network = Network(site.bus[0], self.plant.side_of(site.bus[0]), listening=Standby(0.0))
        self.repeated = Repeated(self.network, self.plant)
        self.nodes = {table.id: QuickNode(table.id) for table in site.bus[0].node}
        self.lose: Callable[[Frame], bool] = lambda frame: False
        self.routes = frozenset(self.network.take_routes() or ())
        self.refresh_at = self.now

    def core(self, node_id: int) -> NodeCore:
        return next(node for node in self.network.nodes if node.table.id == node_id)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while True:
            times = [end, self.refresh_at, self.network.next_deadline() or end]
            times += [node.next_at for node in self.nodes.values() if node.present]
            self.now = min(end, max(self.now, min(times)))
            self.round()
            if self.now >= end:
                return

    def round(self) -> None:
        """One round of the master, until the bus is quiet."""
        for node in self.nodes.values():
            if node.present:
                node.on_time(self.now)
        self.deliver()
        self.network.on_time(self.now)
        for enforcement in self.plant.enforcements(self.now):
            self.network.enforce(enforcement, self.now)
        if self.now >= self.refresh_at:
            self.refresh_at = self.now + 0.1
            self.plant.refresh(self.now)
            self.network.refresh(BusStatus(), self.now)
        while self._send() or self.deliver():
            pass
        self.plant.tell_events()

    def _send(self) -> bool:
        frames = self.network.take_frames()
        self.log += [frame._replace(time=self.now) for frame in frames]
        for frame in frames:
            for node in self.nodes.values():
                if node.present:
                    node.on_frame(frame, self.now)
        return bool(frames)

    def deliver(self) -> bool:
        """Hand the nodes' frames to the master."""
        frames: list[Frame] = []
        for node in self.nodes.values():
            frames += node.outbox
            node.outbox = []
        self.receive(*(frame for frame in frames if not self.lose(frame)))
        return bool(frames)

    def receive(self, *frames: Frame) -> None:
        self.routes = frozenset(self.network.take_routes() or self.routes)
        heard = [frame._replace(time=self.now) for frame in frames if frame.can_id in self.routes]
        if heard:
            self.network.on_frames(heard, self.now)
        foreign = [frame._replace(time=self.now) for frame in frames if frame.can_id in self.network.ours]
        if foreign:
            self.network.on_foreign(foreign, self.now)
        self.plant.tell_events()

    def ask(self, action: Action, target: str, identity: Identity = ENGINEER) -> Outcome:
        outcomes: list[Outcome] = []
        request = Request(identity, target, command_of(action))
        self.plant.submit(request, self.now, outcomes.append, self.network.carry_out)
        assert len(outcomes) == 1, "one request, one outcome"
        return outcomes[0]

    def value(self, name: str) -> object:
        return self.plant.image.read(name).value

    def status(self, node_id: int) -> str:
        return str(self.value(f"n{node_id}/node/boot_status"))

    def states(self) -> str:
        """Each node's NMT state as it is: o, p or s."""
        letters = {OPERATIONAL: "o", PRE_OPERATIONAL: "p", STOPPED: "s"}
        return "".join(letters[node.state] for node in self.nodes.values())

    def nmt(self, since: float = 0.0) -> list[tuple[int, int]]:
        """NMT commands that were sent: command and node id."""
        return [tuple(frame.data) for frame in self.log if frame.can_id == 0 and frame.time >= since]

    def told(self, text: str) -> list[Event]:
        return [event for event in self.events if text in event.message]


def state_of(quick: Quick, node_id: int) -> NmtState:
    value = quick.value(f"n{node_id}/node/nmt_state")
    assert isinstance(value, int)
    return NmtState(value)
