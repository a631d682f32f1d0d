"""Error control (CiA 301 §7.2.8.3): is the node alive? By heartbeat or node guarding, never both.

Both judge by the time stamps of the received frames, so a late event loop does not look like a dead
node: ``on_time`` is called only after the bus has been drained.
"""

from __future__ import annotations

from bridge.canopen import cobid
from bridge.canopen.frame import REMOTE, Frame


class HeartbeatConsumer:
    """Watches one producer. Supervision begins with its first heartbeat (CiA 301 §7.2.8.3.2.2)."""

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._last: float | None = None

    def on_frame(self, frame: Frame) -> bool:
        """Any heartbeat is a sign of life."""
        self._last = frame.time
        return True

    def expect(self, now: float) -> None:
        """Begin supervision now, although the node has not been heard yet."""
        self._last = now

    def reset(self) -> None:
        self._last = None

    def next_deadline(self) -> float | None:
        return None if self._last is None else self._last + self.timeout_s

    def on_time(self, now: float) -> bool:
        """True once when the node has been silent for too long."""
        deadline = self.next_deadline()
        if deadline is None or now < deadline:
            return False
        self._last = None
        return True

    def take_frames(self) -> list[Frame]:
        return []


class NodeGuard:
    """Asks one node by remote frame every ``guard_time_s`` and checks its toggle bit.

    The node counts as lost after ``life_time_factor`` guard times without a correct answer; its own life
    guarding watches us by the same frames (CiA 301 §7.2.8.3.2.1).
    """

    def __init__(self, node_id: int, guard_time_s: float, life_time_factor: int) -> None:
        self._id = cobid.ERROR_CONTROL + node_id
        self.guard_time_s = guard_time_s
        self.life_time_s = guard_time_s * life_time_factor
        self.toggle_errors = 0
        self._toggle: int | None = None
        self._due: float | None = None
        """Time of the next request; None while the node is not guarded."""
        self._last = 0.0
        self._frames: list[Frame] = []

    def on_frame(self, frame: Frame) -> bool:
        """Whether the answer counts. A repeated one (same toggle bit) proves neither that the node is alive
        nor its state; the next correct one does."""
        if self._due is None:
            return True  # not asked by us
        if len(frame.data) != 1:
            return False
        toggle = frame.data[0] & 0x80
        if self._toggle is not None and toggle != self._toggle:
            self.toggle_errors += 1
            self._toggle = toggle ^ 0x80
            return False
        self._toggle = toggle ^ 0x80
        self._last = frame.time
        return True

    def expect(self, now: float) -> None:
        """Begin guarding now. Any first toggle bit is accepted: the node may have been guarded before."""
        self._due = now
        self._last = now
        self._toggle = None

    def reset(self) -> None:
        self._due = None

    def next_deadline(self) -> float | None:
        if self._due is None:
            return None
        return min(self._due, self._last + self.life_time_s)

    def on_time(self, now: float) -> bool:
        """Send what is due; True once when the node has been silent for too long."""
        if self._due is None:
            return False
        if now >= self._last + self.life_time_s:
            self.reset()
            return True
        if now >= self._due:
            # As long as the answer: a remote frame has the DLC of the data frame (ISO 11898-1).
            self._frames.append(Frame(self._id | REMOTE, b"\0"))
            # If we are late, ask once and go on from now: a burst of remote frames would help nobody.
            on_time = self._due + self.guard_time_s
            self._due = on_time if on_time > now else now + self.guard_time_s
        return False

    def take_frames(self) -> list[Frame]:
        frames, self._frames = self._frames, []
        return frames
