"""NMT states, heartbeat and node guarding of a slave (CiA 301 §7.2.8, BU 2500 §6.2 and §8.1.1)."""

from __future__ import annotations

from enum import IntEnum

from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.core.store import Store
from bridge.sim.core.supervision import Cycle, SignWatch
from bridge.sim.core.ticks import earliest


class SlaveState(IntEnum):
    """State of a node as in its heartbeat."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class CommandSpecifier(IntEnum):
    """Command specifier, byte 0 of an NMT frame."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


COMMANDED_STATE = {
    CommandSpecifier.START: SlaveState.OPERATIONAL,
    CommandSpecifier.STOP: SlaveState.STOPPED,
    CommandSpecifier.ENTER_PRE_OPERATIONAL: SlaveState.PRE_OPERATIONAL,
}


def nmt_command_for(node_id: int, data: bytes) -> CommandSpecifier | None:
    """The command in an NMT frame if it is known and for this node (its address, or 0 for all)."""
    if len(data) != 2 or data[1] not in (0, node_id):
        return None
    try:
        return CommandSpecifier(data[0])
    except ValueError:
        return None


class SlaveErrorControl:
    """Heartbeat producer (1017h), guarding answers and life guarding (100Ch × 100Dh)."""

    def __init__(self, store: Store[CommunicationSettings]) -> None:
        self._store = store
        self._toggle = 0
        self._heartbeat = Cycle(lambda: store.current.heartbeat_ms / 1000)
        # BU 2500 §7.1.2 says of P167 = 0 both "off" and "watchdog time = guard time"; CiA 301 says off.
        self.life = SignWatch(lambda: store.current.guard_time_ms * store.current.life_time_factor / 1000)
        """The master's guard requests, from the first one on."""

    def boot(self) -> None:
        """After the boot-up message, which counts as the first heartbeat."""
        self._toggle = 0
        self._heartbeat.reset()
        self.life.stop()

    def on_guard_request(self, state: SlaveState, now: float) -> bytes | None:
        """The answer to a remote frame on 700h + id: state, with bit 7 toggling from 0.

        With a heartbeat time set the node does not answer: only one of the two may be in use
        (CiA 301 §7.2.8.3.2).
        """
        if self._store.current.heartbeat_ms:
            return None
        self.life.start(now)
        answer = bytes([state | self._toggle])
        self._toggle ^= 0x80
        return answer

    def heartbeat_due(self, now: float) -> bool:
        return self._heartbeat.due(now)

    def next_deadline(self) -> float | None:
        return earliest(self.life.next_deadline(), self._heartbeat.next_deadline())
