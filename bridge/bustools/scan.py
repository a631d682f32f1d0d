"""Scan for the nodes of a bus: by their own messages, by SDO and by node guarding. Sans-IO.

All 127 ids are asked side by side. An SDO answer alone proves no node: a device with a second SDO
server answers there for an id that nobody has (Lenze node n on 5C0h + n, which is the first channel of
node n + 64; STÖBER on 5A0h, 5C0h and 5E0h). So an id counts once its error control has been heard, or
once the answers say that they are its own.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Final

from bridge.bustools.task import BusTask
from bridge.canopen import cobid, nmt, width
from bridge.canopen.datatypes import readable
from bridge.canopen.dialogue import Dialogue, SdoRead, ask, attempt
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from bridge.canopen.sdo import Result, SdoChannel, SdoError

_IDS: Final = range(1, 128)
_OTHER_CHANNELS: Final = range(0x1201, 0x1204)
"""Parameter objects of further SDO servers that devices have: NORD and STÖBER 2…4, Lenze 2."""
_TWINS: Final = (96, 64, 32)
"""Distances from its node's id at which another SDO channel shows up on 580h…5FFh."""
_BITS_PER_ID: Final = 400
"""Bits of one request and its answer, and as many again for everybody else on the bus."""
_LEAST_STEP_S: Final = 0.001


@dataclass(frozen=True, slots=True)
class GuardRequest:
    """Ask for the NMT state by remote frame."""


Interview = Generator[SdoRead | GuardRequest, bytes | None, None]


@dataclass(slots=True)
class FoundNode:
    """Findings on one id; None for objects that the node does not have."""

    id: int
    nmt_state: NmtState = NmtState.UNKNOWN
    answers: int = 0
    """Objects that were answered, an abort included."""
    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None
    name: str = ""
    first_channel: int | None = None
    """1200h:1, the COB-ID on which the first SDO server takes its requests."""
    emcy_id: int | None = None
    other_channels: set[int] = field(default_factory=set[int])
    """COB-IDs on which its other SDO servers take requests."""
    has_heartbeat: bool | None = None
    """True if there is a 1017h; None where the node was not asked."""
    has_guarding: bool | None = None
    """True if there is a 100Ch; None where the node was not asked."""
    is_heard: bool = False
    """Boot-up, heartbeat or guarding answer received: nobody else sends on 700h + id."""

    @property
    def identity(self) -> tuple[int | str | None, ...]:
        return (self.device_type, self.vendor, self.product, self.revision, self.serial, self.name)


def _is_silence(answer: Result) -> bool:
    return isinstance(answer, SdoError) and not answer.was_answered


def _number(answer: Result, size: int = 4) -> int | None:
    return width.unsigned(answer, size) if isinstance(answer, bytes) and answer else None


def _interview(node: FoundNode) -> Interview:
    """Ask one node for itself. Ends with its first silence."""
    answer = yield from attempt(0x1000)
    if _is_silence(answer):
        # A stopped node has no SDO and still answers to guarding.
        if not node.is_heard:
            yield GuardRequest()
        return
    node.answers += 1
    node.device_type = _number(answer)
    for sub, name in enumerate(("vendor", "product", "revision", "serial"), 1):
        answer = yield from attempt(0x1018, sub)
        if _is_silence(answer):
            return
        node.answers += 1
        setattr(node, name, _number(answer))
    answer = yield from attempt(0x1008)
    if isinstance(answer, bytes):
        node.name = readable(answer).strip()
    node.first_channel = _number((yield from attempt(0x1200, 1)))
    node.emcy_id = _number((yield from attempt(0x1014)))
    for index in _OTHER_CHANNELS:
        cob_id = _number((yield from attempt(index, 1)))
        if cob_id is None:
            break
        if not cob_id & cobid.PDO_DISABLED:
            node.other_channels.add(cob_id & cobid.COB_ID_MASK)
    node.has_heartbeat = isinstance((yield from attempt(0x1017)), bytes)
    guard_time = yield from attempt(0x100C)
    node.has_guarding = isinstance(guard_time, bytes)
    # The first remote frame would start the node's life guarding, and we send no second one.
    guarded = (_number(guard_time, 2) or 0) * (_number((yield from attempt(0x100D)), 1) or 0)
    if not node.is_heard and not guarded:
        yield GuardRequest()


class Scanner(BusTask):
    """One scan of one bus. ``on_frame`` gets everything that is received; times are monotonic seconds.

    ``passive`` sends nothing and lists who is heard within ``listen_s``.
    """

    def __init__(
        self,
        now: float,
        bitrate: int,
        *,
        passive: bool,
        timeout_s: float = 0.3,
        listen_s: float = 0.5,
        own_id: int | None = None,
    ) -> None:
        """``own_id`` is the bridge's own: a heartbeat with it is no node, an SDO answer is."""
        super().__init__()
        self._nodes = {node_id: FoundNode(node_id) for node_id in _IDS}
        self._channels: dict[int, SdoChannel] = {}
        self._interviews: dict[int, Dialogue[SdoRead | GuardRequest, bytes | None, None, SdoError]] = {}
        self._now = now
        self._guarding: dict[int, float] = {}
        self._timeout_s = timeout_s
        self._own_id = own_id
        self._until = now + listen_s
        step_s = max(_LEAST_STEP_S, _BITS_PER_ID / bitrate)
        self._starts = [] if passive else [(now + n * step_s, node_id) for n, node_id in enumerate(_IDS)]
        self._starts.reverse()
        self.total = len(self._starts)

    @property
    def done(self) -> int:
        """Number of the ``total`` ids that are done."""
        return self.total - len(self._starts) - len(self._interviews)

    def is_finished(self, now: float) -> bool:
        return now >= self._until and not self._starts and not self._interviews

    def on_frame(self, frame: Frame) -> None:
        self._now = max(self._now, frame.time)
        base, node_id = frame.can_id & ~0x7F, frame.can_id & 0x7F
        if base == cobid.SDO_REPLY and node_id in self._channels:
            self._channels[node_id].on_frame(frame)
        elif base == cobid.ERROR_CONTROL and node_id in self._nodes and len(frame.data) == 1:
            self._on_error_control(self._nodes[node_id], frame)

    def _on_error_control(self, node: FoundNode, frame: Frame) -> None:
        state = nmt.state_of(frame.data[0])
        # After its boot-up message a node is Pre-Operational (CiA 301 §7.3.2.2.1).
        node.nmt_state = NmtState.PRE_OPERATIONAL if state is NmtState.INITIALISING else state
        node.is_heard = True
        if self._guarding.pop(node.id, None) is not None:
            self._interviews[node.id].go_on(None, frame.time)

    def on_time(self, now: float) -> None:
        self._now = max(self._now, now)
        while self._starts and self._starts[-1][0] <= now:
            self._begin(self._starts.pop()[1], now)
        for channel in self._channels.values():
            channel.on_time(now)
        for node_id in [node_id for node_id, until in self._guarding.items() if now >= until]:
            del self._guarding[node_id]
            self._interviews[node_id].go_on(None, now)

    def next_deadline(self) -> float | None:
        times = list(self._guarding.values())
        if self._starts:
            times.append(self._starts[-1][0])
        times += [t for channel in self._channels.values() if (t := channel.next_deadline()) is not None]
        return min(times, default=self._until)

    def take_frames(self) -> list[Frame]:
        frames = super().take_frames()
        for channel in self._channels.values():
            frames += channel.take_frames()
        return frames

    def _begin(self, node_id: int, now: float) -> None:
        channel = self._channels[node_id] = SdoChannel(
            cobid.SDO_REQUEST + node_id, cobid.SDO_REPLY + node_id, self._timeout_s
        )

        def do(step: SdoRead | GuardRequest, now: float) -> bool:
            if isinstance(step, SdoRead):
                ask(step, channel, now, lambda answer: interview.go_on(answer, self._now))
            else:
                # DLC 1, as the answer has it.
                self._frames.append(Frame((cobid.ERROR_CONTROL + node_id) | REMOTE, b"\0"))
                self._guarding[node_id] = now + self._timeout_s
            return True

        def done(end: SdoError | None, now: float) -> None:
            del self._interviews[node_id]

        interview = Dialogue(_interview(self._nodes[node_id]), do, done, (SdoError,))
        self._interviews[node_id] = interview
        interview.go_on(None, now)

    # what was found

    def nodes(self) -> list[FoundNode]:
        """The nodes that are there, by id."""
        return [node for node in self._nodes.values() if self._is_there(node)]

    def phantoms(self) -> dict[int, int | None]:
        """Ids that were answered for without being there, each with the node that answered."""
        return {
            node.id: self._owner(node)
            for node in self._nodes.values()
            if node.answers and not self._is_there(node)
        }

    def _is_there(self, node: FoundNode) -> bool:
        if node.is_heard and node.id != self._own_id:
            return True
        # 1000h and one object more: a single stray answer is nobody.
        return node.answers > 1 and self._owner(node) is None

    def _owner(self, node: FoundNode) -> int | None:
        """The other node whose SDO channel has answered for this id, if it was one."""
        for value, base in ((node.first_channel, cobid.SDO_REQUEST), (node.emcy_id, cobid.EMCY)):
            named = None if value is None else (value & cobid.COB_ID_MASK) - base
            if named == node.id:
                return None
            if named in self._nodes and self._nodes[named].answers:
                return named
        for other in self._nodes.values():
            if other is not node and cobid.SDO_REQUEST + node.id in other.other_channels:
                return other.id
        for distance in _TWINS:
            twin = self._nodes.get(node.id - distance)
            if twin and twin.answers and twin.identity == node.identity and (node.serial or twin.is_heard):
                return twin.id
        return None
