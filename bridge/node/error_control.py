"""Error control of one node: presence, NMT state, duplicate node id, boot loop.

The state is always one that the node has reported, never one that it was commanded to.
"""

from __future__ import annotations

from enum import Enum

from bridge.canopen import nmt
from bridge.canopen.duplicate import DuplicateCheck, DuplicateSign
from bridge.canopen.frame import Frame
from bridge.canopen.heartbeat import HeartbeatConsumer, NodeGuard
from bridge.canopen.nmt import NmtState
from bridge.config import NodeTable
from bridge.node.boot.error_status import HINTS
from bridge.node.bootloop import BootLoop
from bridge.text import Text


class Sign(Enum):
    """Content of an error control message."""

    MALFORMED = "malformed"
    BOOT_UP = "boot-up"
    WRONG_TOGGLE = "an answer to node guarding that does not count"
    SAME = "the state it had before"
    CHANGED = "another state"


class ErrorControl:
    """Error control of the node of ``table``."""

    def __init__(self, table: NodeTable) -> None:
        self._table = table
        self._duplicates = DuplicateCheck()
        self.duplicate: DuplicateSign | None = None
        """Sign that two devices have this node id; whoever takes the frame that brings it clears it."""
        self.boot_loop = BootLoop()
        self.state = NmtState.UNKNOWN
        self._toggle_errors_before = 0
        self._supervisor: HeartbeatConsumer | NodeGuard | None = None
        if table.supervision == "heartbeat":
            self._supervisor = HeartbeatConsumer(table.supervision_ms / 1000)
        elif table.supervision == "guarding":
            self._supervisor = NodeGuard(table.id, table.supervision_ms / 1000, table.life_time_factor)

    @property
    def loss(self) -> Text:
        """Text of a loss, with error status E or F of CiA 302-2."""
        if self._table.supervision != "guarding":
            what = Text.of("node.no_heartbeat", ms=self._table.supervision_ms)
            return Text.of("boot.failed_advised", letter="E", what=what, hint=HINTS["E"])
        wrong = self.toggle_errors - self._toggle_errors_before
        if wrong:
            return Text.of("boot.failed", letter="F", what=Text.of("node.wrong_answers", count=wrong))
        return Text.of("boot.failed_advised", letter="F", what=Text.of("node.no_answer"), hint=HINTS["E"])

    @property
    def toggle_errors(self) -> int:
        """Number of answers to node guarding with a wrong toggle bit."""
        return self._supervisor.toggle_errors if isinstance(self._supervisor, NodeGuard) else 0

    def on_frame(self, frame: Frame) -> Sign:
        if len(frame.data) != 1:
            return Sign.MALFORMED
        state = nmt.state_of(frame.data[0])
        if state is NmtState.INITIALISING:
            self._duplicates.restart()
            self.state = NmtState.PRE_OPERATIONAL
            return Sign.BOOT_UP
        if self._supervisor and not self._supervisor.on_frame(frame):
            return Sign.WRONG_TOGGLE
        self.duplicate = self._duplicates.on_heartbeat(state, frame.time)
        if state is self.state:
            return Sign.SAME
        self.state = state
        return Sign.CHANGED

    def begin_await(self, state: NmtState | None) -> bool:
        """Await a report of ``state``, or of any; False where the node never reports its state."""
        if self._supervisor is None:
            self.state = state or self.state
            return False
        # What was reported before the command does not count.
        self.state = NmtState.UNKNOWN
        return True

    def assume(self, state: NmtState) -> None:
        """Take the node to be in this state until it reports another."""
        self.state = state

    def forget_boots(self) -> None:
        """Forget the restarts counted: a command may now cause another."""
        self.boot_loop = BootLoop()

    def on_foreign_request(self, frame: Frame) -> None:
        """Note another SDO client's request to this node: its answer is not for us."""
        self._duplicates.on_foreign_request(frame.time)

    def on_reply(self, frame: Frame, *, matched: bool) -> None:
        """Check an SDO answer for a duplicate node id; ``matched`` where it belonged to a request of ours."""
        self.duplicate = self._duplicates.on_reply(frame.data, frame.time, matched=matched)

    def produces_every(self, period_s: float | None) -> None:
        """Set the heartbeat period that the node kept at boot-up; None for none."""
        self._duplicates.period_s = period_s

    def expect(self, now: float) -> None:
        """Begin supervision: from now on the node has to be heard."""
        self._duplicates.restart()
        self._toggle_errors_before = self.toggle_errors
        if self._supervisor:
            self._supervisor.expect(now)

    def stop(self, now: float, *, lost: bool = False) -> None:
        """End supervision. A guarded node whose loss is only reported goes on being asked: there is no other
        way to hear that it is back."""
        if self._supervisor is None:
            return
        self._supervisor.reset()
        if lost and self._table.on_loss == "nothing" and isinstance(self._supervisor, NodeGuard):
            self._supervisor.expect(now)

    def on_time(self, now: float) -> bool:
        """True once when the node has been silent for too long."""
        return self._supervisor is not None and self._supervisor.on_time(now)

    def next_deadline(self) -> float | None:
        return self._supervisor.next_deadline() if self._supervisor else None

    def take_frames(self) -> list[Frame]:
        return self._supervisor.take_frames() if self._supervisor else []
