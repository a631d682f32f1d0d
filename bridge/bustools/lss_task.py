"""LSS for the command line: selection of a device, services on it, and their transfer. Sans-IO."""

from __future__ import annotations

from typing import Final, Generic, TypeVar

from bridge.bustools.task import BusTask
from bridge.canopen import lss
from bridge.canopen.dialogue import Dialogue
from bridge.canopen.frame import Frame
from bridge.canopen.lss import LssAddress, LssError, LssExchange, Service

_PAUSE_S: Final = 0.02
"""Pause after a request without an answer, seconds: the devices have to act on it."""
_FIRST_QUESTION: Final = 5
"""Factor on the wait for the first question of a scan, which measures how quick the devices are."""
_SAFETY: Final = 4
"""Factor on the time of the slowest answer so far, for the wait for the next ones."""

_R = TypeVar("_R")


class LssTask(BusTask, Generic[_R]):
    """Task that carries a service's requests to the bus and the replies back.

    ``error`` says why it failed; ``steps`` and ``step`` tell how far it is. Times are monotonic seconds.

    In a fastscan silence is an answer, and nothing in an answer says to which question it belongs. So its
    questions are given ``timeout_s`` or four times what the slowest answer has taken, whichever is longer.
    """

    def __init__(self, service: Service[_R], now: float, timeout_s: float) -> None:
        super().__init__()
        self.error: LssError | None = None
        self.steps = 0
        self.step = ""
        self.late = 0
        """Number of answers to a scan that came when none was expected."""
        self._dialogue = Dialogue(service, self._ask, self._done, (LssError,))
        self._timeout_s = timeout_s
        self._exchange: LssExchange | None = None
        self._reply: bytes | None = None
        self._deadline: float | None = None
        self._asked = now
        self._slowest_s = 0.0
        self._result: list[_R] = []
        self._finished = False
        self._dialogue.go_on(None, now)

    def is_finished(self, now: float) -> bool:
        return self._finished and not self._frames

    @property
    def result(self) -> _R:
        """Result of the service. Raises LssError where it failed or has not ended."""
        if not self._result:
            raise self.error or LssError("interrupted")
        return self._result[0]

    def on_frame(self, frame: Frame) -> None:
        exchange = self._exchange
        if frame.can_id != lss.REPLY_ID or exchange is None or len(frame.data) != 8:
            return
        if frame.data[0] == lss.IDENTIFIED:
            self._slowest_s = max(self._slowest_s, frame.time - self._asked)
            self.late += exchange.reply != lss.IDENTIFIED
        if frame.data[0] != exchange.reply or self._reply is not None:
            return
        self._reply = frame.data
        if not exchange.by_many:
            self._advance(frame.data, frame.time)

    def on_time(self, now: float) -> None:
        exchange = self._exchange
        if exchange is None or self._deadline is None or now < self._deadline:
            return
        if self._reply is None and exchange.reply is not None and exchange.fails:
            self._end(LssError(f"no answer: {exchange.step}"))
        else:
            self._advance(self._reply, now)

    def next_deadline(self) -> float | None:
        return self._deadline

    def _advance(self, reply: bytes | None, now: float) -> None:
        self._reply = None
        self._dialogue.go_on(reply, now)

    def _ask(self, exchange: LssExchange, now: float) -> bool:
        self._exchange = exchange
        self.step = exchange.step
        self.steps += 1
        if exchange.request:
            self._frames.append(Frame(lss.REQUEST_ID, exchange.request))
        self._deadline = now + self._wait_s(exchange)
        if exchange.reply == lss.IDENTIFIED:
            self._asked = now
        return True

    def _done(self, end: _R | LssError, now: float) -> None:
        if isinstance(end, LssError):
            self._end(end)
        else:
            self._result.append(end)
            self._end(None)

    def _wait_s(self, exchange: LssExchange) -> float:
        if exchange.reply is None and not exchange.by_many:
            return _PAUSE_S
        least_s = self._timeout_s * (_FIRST_QUESTION if exchange.is_first else 1)
        return max(least_s, _SAFETY * self._slowest_s)

    def _end(self, error: LssError | None) -> None:
        """End the service; after an error all devices are switched back to waiting state."""
        self.error = error
        if error:
            self._frames += [Frame(lss.REQUEST_ID, exchange.request) for exchange in lss.to_waiting()]
        self._dialogue.close()
        self._exchange = self._deadline = None
        self._finished = True


def select(which: LssAddress | None) -> Service[None]:
    """Switch one device to configuration state: the one with this identity, or the only one on the bus."""
    if which is None:
        yield from lss.switch_global(configuration=True)
    else:
        yield from lss.to_waiting()
        yield from lss.switch_selective(which)


def inquire(which: LssAddress | None) -> Service[tuple[LssAddress, int]]:
    """Read identity and node id of a device."""
    yield from select(which)
    identity = yield from lss.inquire_identity()
    node_id = yield from lss.inquire_node_id()
    yield from lss.to_waiting()
    return identity, node_id


def set_node_id(which: LssAddress | None, node_id: int, *, keep: bool) -> Service[None]:
    """Set a new node id; ``keep`` stores it. A device that had none takes it when it leaves configuration."""
    yield from select(which)
    yield from lss.configure_node_id(node_id)
    if keep:
        yield from lss.store()
    yield from lss.to_waiting()


def set_bit_rate(
    which: LssAddress | None, bit_rate: int | None, *, keep: bool, activate_ms: int | None
) -> Service[None]:
    """Set a new bit rate, valid after the device's next start, or within twice ``activate_ms`` from now."""
    yield from select(which)
    yield from lss.configure_bit_rate(bit_rate)
    if keep:
        yield from lss.store()
    if activate_ms is None:
        yield from lss.to_waiting()
    else:
        yield from lss.activate_bit_rate(activate_ms)


def keep_settings(which: LssAddress | None) -> Service[None]:
    """Store node id and bit rate as they are set."""
    yield from select(which)
    yield from lss.store()
    yield from lss.to_waiting()
