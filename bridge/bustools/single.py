"""Single tasks on a bus for the command line: one SDO transfer, one NMT command. Sans-IO."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.bustools.task import NOTHING_KNOWN, BusTask, SdoTasks
from bridge.canopen import cobid, nmt
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.canopen.sdo import Result, SdoChannel
from bridge.canopen.sdo_transfer import MUX, SEGMENT, U32
from bridge.mapping.model import SdoServer

_SDO_BYTES: Final = 8
_EXPECTED: Final = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    # A reset shows in the boot-up message.
    NmtCommand.RESET_NODE: NmtState.INITIALISING,
    NmtCommand.RESET_COMMUNICATION: NmtState.INITIALISING,
}


class SdoTask(SdoTasks):
    """One transfer with an SDO server of a node; ``result`` is None until it has ended.

    ``data`` None reads, bytes are written. ``server`` None is the first. ``known`` says by the COB-ID of its
    requests why a server is not asked for block transfer. Times are monotonic seconds.
    """

    def __init__(
        self,
        node_id: int,
        index: int,
        sub: int,
        data: bytes | None,
        now: float,
        timeout_s: float,
        *,
        retries: int = 0,
        server: SdoServer | None = None,
        known: Mapping[int, str] = NOTHING_KNOWN,
    ) -> None:
        self.result: Result | None = None
        self.done_bytes = 0
        """Bytes transferred so far, by the frames: shows that a long transfer goes on."""
        self.total_bytes = None if data is None else len(data)
        """Bytes of the whole transfer; for a read known once the server has announced them."""
        self._mux = MUX.pack(index, sub)
        self._writes = data is not None
        request, reply = (server.request, server.reply) if server else (cobid.SDO_REQUEST, cobid.SDO_REPLY)
        channel = SdoChannel(
            request + node_id,
            reply + node_id,
            timeout_s,
            retries=retries,
            why_no_block=known.get(request + node_id, ""),
        )
        super().__init__([channel], now)
        if data is None:
            channel.read(index, sub, now, self._done)
        else:
            channel.write(index, sub, data, now, self._done)

    def _done(self, result: Result) -> None:
        self.result = result

    def is_finished(self, now: float) -> bool:
        return self.result is not None

    def on_frame(self, frame: Frame) -> None:
        if frame.can_id in self._channels:
            self._count(frame.data)
        super().on_frame(frame)

    def take_frames(self) -> list[Frame]:
        frames = super().take_frames()
        if self._writes:
            self._add(sum(frame.data[1:4] != self._mux for frame in frames))
        return frames

    def _count(self, data: bytes) -> None:
        """Count an answer of a read: it announces the length, or is a segment."""
        if self._writes or len(data) != _SDO_BYTES:
            return
        if data[1:4] != self._mux:
            self._add(1)
        elif self.total_bytes is None and data[0] & 0xE3 == 0x41:
            self.total_bytes = U32.unpack_from(data, 4)[0]

    def _add(self, segments: int) -> None:
        self.done_bytes += SEGMENT * segments
        if self.total_bytes is not None:
            self.done_bytes = min(self.done_bytes, self.total_bytes)


class NmtTask(BusTask):
    """One NMT command to a node, or to all with ``node_id`` 0, and the states that nodes report afterwards.
    One node is waited for until it has reached its state, all of them for the whole of ``wait_s``."""

    def __init__(self, command: NmtCommand, node_id: int, now: float, wait_s: float) -> None:
        super().__init__()
        self.states: dict[int, NmtState] = {}
        """Last state that each node has reported since the command."""
        self.reached: set[int] = set()
        """Nodes that have reported the state that the command leads to."""
        self._expected = _EXPECTED[command]
        self._node_id = node_id
        self._until = now + wait_s
        self._frames = [nmt.command(command, node_id)]

    def is_finished(self, now: float) -> bool:
        return now >= self._until or (self._node_id in self.reached)

    def on_frame(self, frame: Frame) -> None:
        node_id = frame.can_id - cobid.ERROR_CONTROL
        if not 1 <= node_id <= 127 or self._node_id not in (0, node_id) or len(frame.data) != 1:
            return
        if self._frames:
            return  # said before the command
        state = nmt.state_of(frame.data[0])
        if state is self._expected:
            self.reached.add(node_id)
        self.states[node_id] = NmtState.PRE_OPERATIONAL if state is NmtState.INITIALISING else state

    def next_deadline(self) -> float | None:
        return self._until
