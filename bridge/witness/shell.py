"""Shell of the witness: it waits for frames and answers, and hands the findings on."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Sequence

from bridge.witness.bus_judge import BusJudge
from bridge.witness.can import CanSocket
from bridge.witness.findings import Finding
from bridge.witness.numbers import Numbers
from bridge.witness.plan import WatchedBus

_TICK_S = 0.05


class CannotListen(Exception):
    """Interfaces cannot be opened; the message has a line for each."""


class Witness:
    """Any number of buses. ``tell`` gets each finding in the order of its time.

    Raises CannotListen where interfaces cannot be opened.
    """

    def __init__(
        self, buses: Sequence[WatchedBus], numbers: Numbers | None, tell: Callable[[Finding], None]
    ) -> None:
        self._numbers = numbers
        self._tell = tell
        self._lines: list[tuple[CanSocket, BusJudge]] = []
        self._places = {
            one.unit_id: (place, one.name)
            for place, bus in enumerate(buses)
            for one in (*bus.drives, *bus.judged_outputs)
        }
        failures: list[str] = []
        for bus in buses:
            watch = BusJudge(bus, asks=numbers is not None)
            try:
                self._lines.append((CanSocket(bus.channel, watch.identifiers), watch))
            except OSError as error:
                failures.append(f"cannot listen on {bus.channel}: {error.strerror or error}")
        if failures:
            self.close()
            raise CannotListen("\n".join(failures))

    def close(self) -> None:
        for listener, _ in self._lines:
            listener.close()
        if self._numbers:
            self._numbers.close()

    def run_until(self, until: Callable[[float], bool]) -> None:
        """Watch until ``until`` returns true; it is called after every turn."""
        while not until(now := time.monotonic()):
            self._wait(now)
            self._turn()

    def _wait(self, now: float) -> None:
        waited = [listener.fileno() for listener, _ in self._lines]
        timeout_s = _TICK_S
        if self._numbers:
            timeout_s = min(timeout_s, max(0.0, self._numbers.next_deadline() - now))
            number = self._numbers.fileno()
            waited += [] if number is None else [number]
        select.select(waited, [], [], timeout_s)

    def _turn(self) -> None:
        # Answers before frames: a frame that is fetched later than an answer may be older, never younger.
        if self._numbers:
            now = time.monotonic()
            for unit, number, timeout_ms, asked_at, answered_at in self._numbers.receive(now):
                place, name = self._places[unit]
                self._lines[place][1].on_number(name, number, asked_at, answered_at, timeout_ms)
            self._numbers.on_time(time.monotonic())
            if self._numbers.take_lost():
                for _, watch in self._lines:
                    watch.on_numbers_lost(self._numbers.why)
        now = time.monotonic()
        findings: list[Finding] = []
        for listener, watch in self._lines:
            for can_id, data, at in listener.frames():
                watch.on_frame(can_id, data, at)
            watch.on_time(now)
            findings += watch.take_findings()
        for finding in sorted(findings, key=lambda finding: finding.time):
            self._tell(finding)
