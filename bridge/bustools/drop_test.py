"""The supervised proof that a node's drives notice a silent bridge. Sans-IO.

The node is booted as the bridge boots it and gets stopped words, until all that it watches is running. Then
nothing is sent any more, for the drives' own time and a margin, and what comes from the node is timed. Where
the site stops a drive by silence, the RPDOs alone end: heartbeat, guarding and SYNC go on, as they do then.
No drive is ever enabled: one that stands still shows the same emergency message and the same fault as one
that moves, and nothing can be hurt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from bridge.bustools.muted_bus import MutableBus
from bridge.bustools.task import BusTask
from bridge.canopen import cobid, nmt
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Drive, Event, EventKind, Plant
from bridge.command.node import Node
from bridge.command.outputs import Outputs
from bridge.drive import FAULTED, MOVING, DriveState, OwnJudgement
from bridge.master.network import Network

BOOT_WITHIN_S: Final = 30.0
ARM_S: Final = 1.0
"""Time of sending everything before the silence, seconds: the first RPDO, heartbeat or guard request starts
the drive's supervision."""
MARGIN_S: Final = 1.0
UNKNOWN_S: Final = 5.0
"""Longest wait for a drive whose own time-out is not known, or off, seconds."""
RETURN_S: Final = 1.0
RETURN_WITHIN_S: Final = 20.0
MESSAGE_MS: Final = 50
"""Longest delay of the emergency message or TPDO that shows the reaction, ms."""


class Phase(StrEnum):
    BOOTING = "booting the node"
    ARMING = "sending stopped words"
    SILENT = "silent"
    RETURNING = "reading what has become of it"
    DONE = "done"


class Proof(StrEnum):
    REACTED = "reacted"
    NOTICED = "noticed"
    """The node left Operational (CiA 301: heartbeat or life guarding event); at rest no more may show."""
    LATE = "late"
    NOTHING = "did nothing"


@dataclass(slots=True)
class DropOutcome:
    """One drive, or a node with outputs instead. Times in ms are from the last frame that was sent."""

    drive: str
    own: OwnJudgement
    state_before: DriveState
    seen: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    """Messages from it in the silence: time in ms and text."""
    reacted_ms: float | None = None
    noticed_ms: float | None = None
    state_after: DriveState = DriveState.UNKNOWN
    fault_after: str = ""
    latency_ms: int = MESSAGE_MS
    """Delay in ms of a node that shows its state in its heartbeat."""
    rpdos_alone: bool = False
    """True if all but the RPDOs went on."""

    @property
    def own_ms(self) -> float:
        """The drive's own time-out that the test waits for, 0 where it has none."""
        return self.own.process_data_ms if self.rpdos_alone else self.own.own_ms

    @property
    def own_text(self) -> str:
        """The time-out that counts, or why there is none, and the settings that were read."""
        if self.own_ms:
            told = f"{self.own_ms:g} ms"
        elif self.own.first is not None:
            told = "none without RPDOs alone: heartbeat, guarding and SYNC go on"
        else:
            told = f"none that stops it: {self.own.reason}"
        settings = ", ".join(one.setting for one in self.own.watches)
        return f"{told} (read: {settings})" if settings else told

    @property
    def bound_ms(self) -> float:
        """Longest time in ms from the last frame to the reaction; 0 where none is expected."""
        return self.own_ms + MESSAGE_MS if self.own_ms else 0.0

    @property
    def proof(self) -> Proof:
        if self.reacted_ms is not None:
            return Proof.LATE if self.bound_ms and self.reacted_ms > self.bound_ms else Proof.REACTED
        if self.noticed_ms is None:
            return Proof.NOTHING
        bound_ms = self.own_ms + MESSAGE_MS + self.latency_ms
        return Proof.LATE if self.own_ms and self.noticed_ms > bound_ms else Proof.NOTICED

    @property
    def is_proven(self) -> bool:
        at_rest = self.state_after not in MOVING
        return at_rest and self.proof in (Proof.REACTED, Proof.NOTICED)


class DropTest:
    """Watches ``node`` of ``network`` through the phases; ``on_round`` is the master's ``alive``.

    ``done`` is called once. ``failure`` says why there is no result; then ``outcomes`` is empty.
    """

    def __init__(
        self, network: Network, plant: Plant, node: Node, bus: MutableBus, done: Callable[[], None]
    ) -> None:
        self.phase = Phase.BOOTING
        self.failure = ""
        self.outcomes: list[DropOutcome] = []
        self.silent_s = 0.0
        """Length of the silence, seconds."""
        self.notes = ""
        """Notes of the boot-up."""
        self.rpdos_alone = any(drive.falls_silent for drive in node.table.drive)
        """True if the site stops drives of the node by ending their RPDOs, and by nothing else."""
        self._core = next(core for core in network.nodes if core.node is node)
        self._plant = plant
        self._node = node
        self._bus = bus
        self._done = done
        self._since: float | None = None
        plant.on_event(self._on_event)

    # the master's rounds

    def on_round(self, now: float) -> None:
        if self._since is None:
            self._since = now
        match self.phase:
            case Phase.BOOTING:
                self._wait_for_boot(now)
            case Phase.ARMING:
                self._wait_for_watches(now)
            case Phase.SILENT:
                self._look_at_states()
                if now >= self._since + self.silent_s:
                    self._speak(now)
            case Phase.RETURNING:
                self._wait_for_return(now)
            case Phase.DONE:
                pass

    def _enter(self, phase: Phase, now: float) -> None:
        self.phase, self._since = phase, now

    def _spent_s(self, now: float) -> float:
        return now - (now if self._since is None else self._since)

    def _fail(self, why: str) -> None:
        self.failure = why
        self.outcomes = []
        self.phase = Phase.DONE
        self._done()

    def _status(self) -> str:
        return str(self._plant.image.read(f"{self._node.name}/node/boot_status").value)

    def _wait_for_boot(self, now: float) -> None:
        if self._core.is_operational:
            self.notes = self._status()
            self._enter(Phase.ARMING, now)
        elif self._spent_s(now) >= BOOT_WITHIN_S:
            self._fail(f"{self._node.name} is not operational: {self._status()}")

    def _wait_for_watches(self, now: float) -> None:
        if not self._core.is_operational:
            self._fail(f"{self._node.name} was lost before the test began: {self._status()}")
            return
        if self._spent_s(now) < ARM_S:
            return
        moving = [drive.name for drive in self._node.drives if drive.channel.state in MOVING]
        moving += [outputs.name for outputs in self._outputs if outputs.is_active]
        if moving:
            self._fail(
                f"{', '.join(moving)} is enabled, although it is told to stop: something else enables it"
            )
            return
        self._fall_silent(now)

    def _fall_silent(self, now: float) -> None:
        pdos = self._core.wire.drives.values()
        rpdos = frozenset(rpdo.cob_id for one in pdos for rpdo in one.rpdos)
        self._bus.mute(rpdos if self.rpdos_alone else None)
        times_s: list[float] = []
        table = self._node.table
        latency_ms = table.supervision_ms if table.supervision == "heartbeat" else 0
        before = [(drive, drive.channel.state) for drive in self._node.drives]
        for one, state in [*before, *((outputs, DriveState.UNKNOWN) for outputs in self._outputs)]:
            own = one.own or OwnJudgement()
            outcome = DropOutcome(one.name, own, state, latency_ms=latency_ms, rpdos_alone=self.rpdos_alone)
            self.outcomes.append(outcome)
            times_s.append(outcome.own_ms / 1000 or UNKNOWN_S)
        self.silent_s = max(times_s) + MARGIN_S
        self._enter(Phase.SILENT, now)

    def _speak(self, now: float) -> None:
        self._bus.unmute()
        self._enter(Phase.RETURNING, now)

    def _wait_for_return(self, now: float) -> None:
        spent_s = self._spent_s(now)
        if spent_s < RETURN_S or (spent_s < RETURN_WITHIN_S and not self._core.is_operational):
            return
        for drive, outcome in self._pairs():
            outcome.state_after = drive.channel.state
            outcome.fault_after = drive.channel.fault_text
        self.phase = Phase.DONE
        self._done()

    # what is seen in the silence

    @property
    def _outputs(self) -> list[Outputs]:
        """Outputs of a node that is no drive. They send nothing themselves: the node leaves Operational."""
        return [one for one in self._node.commanded if isinstance(one, Outputs)]

    def _pairs(self) -> list[tuple[Drive, DropOutcome]]:
        """Each drive with its outcome; outputs are not among them."""
        return list(zip(self._node.drives, self.outcomes, strict=False))

    def _after_ms(self, at: float) -> float:
        return round(1000 * (at - self._bus.last_sent), 1)

    def _on_event(self, event: Event) -> None:
        """An emergency message, whose event has the time of its frame."""
        if self.phase is not Phase.SILENT or event.kind is not EventKind.EMERGENCY or event.severity < _COMES:
            return
        for outcome in self.outcomes:
            if outcome.drive == event.source:
                self._note_reaction(outcome, event.time, event.message)

    def _look_at_states(self) -> None:
        for drive, outcome in self._pairs():
            is_new = drive.channel.state is not outcome.state_before
            if is_new and drive.channel.state in FAULTED and drive.channel.link.last_pdo is not None:
                text = f"state {drive.channel.state.label}"
                if text not in (seen for _, seen in outcome.seen):
                    self._note_reaction(outcome, drive.channel.link.last_pdo, text)

    def _note_reaction(self, outcome: DropOutcome, at: float, text: str) -> None:
        after_ms = self._after_ms(at)
        outcome.seen.append((after_ms, text))
        if outcome.reacted_ms is None or after_ms < outcome.reacted_ms:
            outcome.reacted_ms = after_ms

    def on_frame(self, frame: Frame) -> None:
        """A frame of others; the node's own state is taken from its error control messages."""
        is_state = frame.can_id == cobid.ERROR_CONTROL + self._node.table.id and len(frame.data) == 1
        if self.phase is not Phase.SILENT or not is_state:
            return
        state = nmt.state_of(frame.data[0] & 0x7F)
        if state in (None, NmtState.OPERATIONAL):
            return
        for outcome in self.outcomes:
            if outcome.noticed_ms is None:
                outcome.noticed_ms = self._after_ms(frame.time)
                outcome.seen.append((outcome.noticed_ms, f"node {state.words}"))


_COMES: Final = 700
"""Least severity of an emergency message that sets an error; one that resets it has less."""


class ForeignMaster(BusTask):
    """Listener for another master of this bus: with one no test must be made. ``found`` says what was heard.

    ``commands`` are the identifiers of the node's RPDOs.
    """

    def __init__(self, own_id: int, commands: frozenset[int], now: float, listen_s: float) -> None:
        super().__init__()
        self.found = ""
        self._own_id = own_id
        self._commands = commands
        self._until = now + listen_s

    def is_finished(self, now: float) -> bool:
        return now >= self._until or bool(self.found)

    def on_frame(self, frame: Frame) -> None:
        identifier = frame.can_id & ~REMOTE
        if frame.can_id == cobid.ERROR_CONTROL + self._own_id:
            self.found = f"the heartbeat of node {self._own_id}, the bridge's own id"
        elif frame.can_id == cobid.NMT:
            self.found = f"an NMT command: {nmt.describe(frame.data)}"
        elif frame.can_id == cobid.SYNC:
            self.found = "SYNC"
        elif frame.can_id in self._commands:
            self.found = f"commands for this node ({frame.can_id:03X}h)"
        elif frame.can_id & REMOTE and identifier > cobid.ERROR_CONTROL:
            self.found = f"guarding of node {identifier - cobid.ERROR_CONTROL}"

    def next_deadline(self) -> float | None:
        return self._until
