"""A whole CANopen side on a virtual clock: master, networks, simulated nodes, one wire.

Time passes only by ``run``; a lost frame is a line in a test.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bridge.can.burstend import Burst
from bridge.can.interface import BusStatus, ControllerState
from bridge.can.softbursts import SoftBursts
from bridge.canopen.frame import Frame
from bridge.catalogue import Catalogue
from bridge.command import Action, Event, Identity, Outcome, Plant, PlantView, Request, Source, command_of
from bridge.config import Site, load_site
from bridge.mapping import Family, load_family
from bridge.master.ending import Ending, end, nmt_stops
from bridge.master.master import Master
from bridge.master.network import Network
from bridge.master.standby import Standby, listen_s
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support import sites

NORD = load_family("nord/sk-tu4-cao")
PLC = Identity(Source.MODBUS, "192.168.1.10")


def write_site(folder: Path, *, bus: str = "", node: str = "", drive: str = "") -> Site:
    drives = (
        sites.drive("fu1", "modbus", 200, f"{sites.SCALED}\n{drive}"),
        sites.drive("fu2", "zenoh", 200),
    )
    whole = sites.bus(sites.node(*drives, more=node), more=bus)
    return load_site(sites.write(folder, whole, sites.modbus(), sites.zenoh(), name="bench"))


BEGIN_S = 1000.0
NOON_NS = 1_795_262_400_000_000_000
"""2026-11-21 12:00 UTC: the wall clock when the bench begins."""


def epoch_ns(at: float) -> int:
    return NOON_NS + round((at - BEGIN_S) * 1e9)


class ClockBus:
    """A bus on the bench's clock: what is sent arrives at once."""

    def __init__(self, deliver: Callable[[Frame], None]) -> None:
        self.name = "can0"
        self.status = BusStatus()
        self.inbox: list[Frame] = []
        self.accepted: frozenset[int] = frozenset()
        self.ours: frozenset[int] = frozenset()
        self.foreign: list[Frame] = []
        self.is_looking = True
        """Else what others send is found only when it is asked for at once."""
        self._deliver = deliver
        self._bursts = SoftBursts()

    def open(self, wake: Callable[[], None]) -> None: ...

    def accept(self, can_ids: list[int]) -> None:
        self.accepted = frozenset(can_ids)

    def watch(self, can_ids: frozenset[int]) -> None:
        self.ours = can_ids

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        if not (self.is_looking or at_once):
            return []
        if not self.foreign:
            return []
        frames, self.foreign = self.foreign, []
        return [frame._replace(time=min(frame.time, now)) for frame in frames]

    def drain(self, now: float) -> list[Frame]:
        frames, self.inbox = self.inbox, []
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        if self.status.state not in (ControllerState.DOWN, ControllerState.BUS_OFF):
            self._deliver(frame._replace(time=now))

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        frame = self._bursts.start(burst, now, at_once=at_once)
        if frame is not None:
            self._send_of_burst(frame, now)

    def _send_of_burst(self, frame: Frame, now: float) -> None:
        self.send(frame, now, now)
        if frame.can_id in self.accepted:
            self.inbox.append(frame._replace(time=now))

    def end_burst(self, can_id: int) -> None:
        self._bursts.end(can_id)

    def next_deadline(self) -> float | None:
        return self._bursts.next_deadline()

    def on_time(self, now: float) -> None:
        for frame in self._bursts.due(now):
            self._send_of_burst(frame, now)

    def clear(self) -> None:
        self._bursts.clear()

    def close(self) -> None:
        self.clear()


class Bench:
    """``log`` has every frame of the wire in order; ``cut`` keeps the node's frames from the
    master, ``deaf_to`` those with these identifiers."""

    def __init__(
        self,
        site: Site,
        *,
        present: bool = True,
        family: Family = NORD,
        mapping: str = "nord/sk-tu4-cao",
        node: Any = None,
        begin_s: float = BEGIN_S,
        listens: bool = False,
    ) -> None:
        self.now = begin_s
        self.log: list[Frame] = []
        self.events: list[Event] = []
        self.cut = False
        self.deaf_to: frozenset[int] = frozenset()
        self.plant = Plant(Catalogue.of(site, {mapping: family}), "0")
        self.plant.on_event(self.events.append)
        self.bus = self.make_bus()
        # Most tests begin where the bridge has listened already.
        listening = Standby(listen_s(site.bus[0]) if listens else 0.0, lambda: 0.0)
        self.network = Network(site.bus[0], self.plant.side_of(site.bus[0]), epoch_ns, listening=listening)
        self.master = Master([(self.bus, self.network)], self.plant, self.clock)
        self.view = PlantView(self.plant, self.clock, epoch_ns, self.master.carry_out, self.master.wake)
        self.wake_at = self.now
        self.master.attach(self._set_timer)
        self.node = NordTu4(5) if node is None else node
        self.powered = False
        if present:
            self.power_on()

    def make_bus(self) -> ClockBus:
        return ClockBus(self._from_master)

    def clock(self) -> float:
        """Time by which the master goes."""
        return self.now

    def power_on(self) -> None:
        self.powered = True
        self.node.start(self.now)

    def _set_timer(self, at: float) -> None:
        self.wake_at = at

    def _from_master(self, frame: Frame) -> None:
        self.log.append(frame)
        if self.powered and not self.cut:
            self.node.on_frame(frame, self.now)

    def _from_node(self) -> bool:
        frames = [frame._replace(time=self.now) for frame in self.node.take_frames()] if self.powered else []
        self.log += frames
        if not self.cut:
            self.receive(*frames)
        return bool(frames) and not self.cut

    def receive(self, *frames: Frame) -> None:
        """Frames for the master, whoever sent them."""
        for frame in frames:
            if frame.can_id in self.bus.accepted and frame.can_id not in self.deaf_to:
                self.bus.inbox.append(frame._replace(time=self.now))
            if frame.can_id in self.bus.ours:
                self.bus.foreign.append(frame._replace(time=self.now))

    def turn(self) -> None:
        """The master is woken, by its timer or by the bus."""
        self.master.take_in()

    def run(self, seconds: float) -> None:
        """Let time pass; everything happens at its own moment."""
        end = self.now + seconds
        while True:
            node_at = self.node.next_deadline() if self.powered else None
            self.now = min(end, max(self.now, min(self.wake_at, node_at if node_at is not None else end)))
            if node_at is not None and node_at <= self.now:
                self.node.on_time(self.now)
            self.turn()
            while self._from_node():
                self.turn()
            if self.now >= end:
                return

    def hang(self, seconds: float) -> None:
        """The bridge's process stands still; the bus and the node go on."""
        end = self.now + seconds
        while self.now < end:
            times = [self.bus.next_deadline(), self.node.next_deadline()]
            self.now = min([end, *(t for t in times if t is not None and t > self.now)])
            self.bus.on_time(self.now)
            self.node.on_time(self.now)
            self._from_node()

    def end(self) -> Ending:
        """What the master reports at its end, and does about what has not followed."""
        ending = end(self.plant)
        for enforcement in nmt_stops(self.plant, ending):
            self.network.enforce(enforcement, self.now)
        return ending

    def write(self, drive: str = "conveyor/fu1", identity: Identity = PLC, **values: int | float) -> Outcome:
        return self.ask(Action.WRITE, drive, identity, values=values)

    def ask(
        self, action: Action, target: str = "conveyor/fu1", identity: Identity = PLC, **more: Any
    ) -> Outcome:
        outcomes: list[Outcome] = []
        request = Request(identity, target, command_of(action, **more))
        self.view.submit(request, outcomes.append)
        assert len(outcomes) == 1, "one request, one outcome"
        return outcomes[0]

    def keep_writing(self, seconds: float, **values: int | float) -> None:
        """Write every 50 ms, as a controller does."""
        for _ in range(round(seconds / 0.05)):
            self.write(**values)
            self.run(0.05)

    def sent(self, can_id: int) -> list[Frame]:
        return [frame for frame in self.log if frame.can_id == can_id]

    def value(self, name: str) -> object:
        return self.plant.image.read(name).value

    def number(self, name: str) -> int:
        value = self.value(name)
        assert isinstance(value, int)
        return value
