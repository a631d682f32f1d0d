"""NMT states, heartbeat and node guarding of a slave (CiA 301 §7.2.8, BU 2500 §6.2 and §8.1.1)."""

from __future__ import annotations

from enum import IntEnum

from bridge.sim.settings import CommunicationSettings
from bridge.sim.store import Store


class NmtState(IntEnum):
    """State of a node as in its heartbeat."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class NmtCommand(IntEnum):
    """Command specifier, byte 0 of an NMT frame."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


COMMANDED_STATE = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


def nmt_command_for(node_id: int, data: bytes) -> NmtCommand | None:
    """The command in an NMT frame if it is known and for this node (its address, or 0 for all)."""
    if len(data) != 2 or data[1] not in (0, node_id):
        return None
    try:
        return NmtCommand(data[0])
    except ValueError:
        return None


class ErrorControl:
    """Heartbeat producer (1017h), guarding answers and life guarding (100Ch × 100Dh)."""

    def __init__(self, store: Store[CommunicationSettings]) -> None:
        self._store = store
        self._toggle = 0
        self._guarded_at: float | None = None
        self._heartbeat_ms = 0
        self._heartbeat_at = 0.0
        self.master_lost = False

    def boot(self) -> None:
        """After the boot-up message, which counts as the first heartbeat."""
        self._toggle = 0
        self._guarded_at = None
        self._heartbeat_ms = 0
        self.master_lost = False

    def on_guard_request(self, state: NmtState, now: float) -> bytes | None:
        """The answer to a remote frame on 700h + id: state, with bit 7 toggling from 0.

        With a heartbeat time set the node does not answer: only one of the two may be in use
        (CiA 301 §7.2.8.3.2).
        """
        if self._store.current.heartbeat_ms:
            return None
        self._guarded_at = now
        self.master_lost = False
        answer = bytes([state | self._toggle])
        self._toggle ^= 0x80
        return answer

    def life_time_expired(self, now: float) -> bool:
        """True once, when the master has been silent for the life time after its first guard request."""
        deadline = self._life_deadline()
        if deadline is None or now < deadline:
            return False
        self._guarded_at = None
        self.master_lost = True
        return True

    def heartbeat_due(self, now: float) -> bool:
        """Whether a heartbeat is to be sent now. After a pause there is one; missed ones are skipped."""
        heartbeat_ms = self._store.current.heartbeat_ms
        if heartbeat_ms != self._heartbeat_ms:  # just written: the new period begins now
            self._heartbeat_ms = heartbeat_ms
            self._heartbeat_at = now + heartbeat_ms / 1000
            return False
        if not heartbeat_ms or now < self._heartbeat_at:
            return False
        self._heartbeat_at += heartbeat_ms / 1000
        if self._heartbeat_at <= now:
            self._heartbeat_at = now + heartbeat_ms / 1000
        return True

    def next_deadline(self) -> float | None:
        life = self._life_deadline()
        if not self._heartbeat_ms:
            return life
        return self._heartbeat_at if life is None else min(life, self._heartbeat_at)

    def _life_deadline(self) -> float | None:
        settings = self._store.current
        # BU 2500 §7.1.2 says of P167 = 0 both "off" and "watchdog time = guard time"; CiA 301 says off.
        life_ms = settings.guard_time_ms * settings.life_time_factor
        if self._guarded_at is None or not life_ms:
            return None
        return self._guarded_at + life_ms / 1000
