"""Everything that an 8400 motec supervises on the bus, with its reactions (EDS84DMOTCAN 3.0, §10, §12.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.supervision import HeartbeatWatch, SignWatch
from bridge.sim.core.ticks import earliest
from bridge.sim.lenze.lenze_drive import LenzeDrive, Reaction
from bridge.sim.lenze.lenze_settings import PDOS, LenzeCodes, heartbeat_step
from bridge.sim.lenze.lenze_supervision import (
    CAN_WARNING,
    COB_ID_COLLISION,
    HEARTBEAT_LOST,
    PDO_TOO_LONG,
    PDO_TOO_SHORT,
    SUPPLY_FAILED,
    ErrorReporter,
    LenzeError,
)

_LATE: Final = (LenzeError.RPDO1_LATE, LenzeError.RPDO2_LATE)
BUS_OFF: Final = 3
"""C00345."""


class LenzeWatch:
    """Reports errors and their end to the drive, and to the bus by EMCY."""

    def __init__(self, codes: Callable[[], LenzeCodes], drive: LenzeDrive, emcy: EmcyProducer) -> None:
        self._codes = codes
        self._drive = drive
        self._reporter = ErrorReporter(emcy)
        self._monitors = [self._monitor(number) for number in range(PDOS)]
        self._consumer = HeartbeatWatch(
            lambda: codes().watched_node, lambda: heartbeat_step(codes().watched_ms)
        )

    @property
    def node(self) -> int:
        """The node whose heartbeat is watched, or 0."""
        return self._consumer.node

    @property
    def node_status(self) -> int:
        """C00347/1."""
        return self._consumer.status

    def reset(self) -> None:
        for monitor in self._monitors:
            monitor.stop()
        self._consumer.stop()
        self._reporter.reset()

    def nmt_changed(self, state: SlaveState, now: float) -> None:
        for monitor in self._monitors:
            if state is SlaveState.OPERATIONAL:
                monitor.start(now)
            else:
                monitor.stop()
        # The manual does not say which node's stop is meant; here it is this node's (§12.2, C00592/4).
        stopped = state is SlaveState.STOPPED
        self._watch(LenzeError.COMMUNICATION_STOPPED, stopped, self._codes().bus_reactions[3])

    def on_rpdo(self, number: int, now: float) -> None:
        """An RPDO, numbered from 0, has taken effect."""
        self._monitors[number].start(now)
        self._drive.cause_gone(_LATE[number])

    def on_heartbeat(self, data: bytes, now: float) -> None:
        self._consumer.on_heartbeat(data, now)
        self._watch(LenzeError.HEARTBEAT, False, Reaction.NONE, HEARTBEAT_LOST)

    def check_length(self, length: int, expected: int) -> None:
        """Check the length of an RPDO, in bytes (§10.4)."""
        reaction = self._codes().bus_reactions[0]
        self._watch(LenzeError.FAULTY_TELEGRAM, length < expected, reaction, PDO_TOO_SHORT)
        self._reporter.communication_error(PDO_TOO_LONG, is_there=length > expected)

    def bus_error(self, state: int) -> None:
        """C00345 has changed."""
        reactions = self._codes().bus_reactions
        self._watch(LenzeError.CAN_WARNING, state in (1, 2), reactions[2], CAN_WARNING)
        self._watch(LenzeError.BUS_OFF, state == BUS_OFF, reactions[1])

    def supply(self, *, there: bool) -> None:
        self._reporter.communication_error(SUPPLY_FAILED, is_there=not there)

    def expire(self, now: float) -> bool:
        """Apply the time-outs up to ``now``. True if the heartbeat is late: the node leaves Operational."""
        codes = self._codes()
        for number, monitor in enumerate(self._monitors):
            if monitor.expired(now):
                self._watch(_LATE[number], True, codes.rpdo_reactions[number])
        if not self._consumer.expired(now):
            return False
        self._watch(LenzeError.HEARTBEAT, True, codes.bus_reactions[4], HEARTBEAT_LOST)
        return True

    def report(self, stack: CommunicationSettings) -> None:
        """Report identifiers received and sent (§10.4), and the drive's own errors."""
        received = {pdo.cob_id for pdo in stack.rpdo if pdo.enabled}
        sent = {pdo.cob_id for pdo in stack.tpdo if pdo.enabled}
        self._reporter.communication_error(COB_ID_COLLISION, is_there=bool(received & sent))
        self._reporter.device_errors(self._drive.errors)

    def next_deadline(self) -> float | None:
        return earliest(self._consumer.next_deadline(), *(one.next_deadline() for one in self._monitors))

    def _monitor(self, number: int) -> SignWatch:
        """C00357: while the node is operational, the next RPDO must come within this time (§10.1)."""
        return SignWatch(lambda: self._codes().rpdo_time_ms[number] / 1000)

    def _watch(self, number: LenzeError, present: bool, reaction: int, code: int = 0) -> None:
        """Note that something supervised has come or gone: ``reaction`` of C00592, and EMCY ``code``."""
        if present:
            self._drive.error(number, Reaction(reaction))
        else:
            self._drive.cause_gone(number)
        if code:
            self._reporter.communication_error(code, is_there=present)
