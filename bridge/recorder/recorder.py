"""The flight recorder of a service: the tape of its core, the ring on disk, and what is written out around an
incident."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import hashlib
import logging
import os
import signal
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import bridge
from bridge import __version__
from bridge.base import clock
from bridge.base.guard import Guard
from bridge.can.interface import Bus
from bridge.command import Event, EventKind, PlantView
from bridge.command.plant import Plant
from bridge.config import Site
from bridge.master.master import Master
from bridge.recorder import checkpoint
from bridge.recorder.core_names import Unusable
from bridge.recorder.recording import Header, State, header_chunk, state_chunk
from bridge.recorder.ring import Ring
from bridge.recorder.tape import RecordedAlarm, TapedBus, machine_tape
from bridge.text import Text

_log = logging.getLogger(__name__)

_LOOK_S: Final = 0.2
"""Period of writing to the ring, seconds: what a killed process loses."""
_SEGMENT_S: Final = 300.0
_RETRY_S, _LONGEST_RETRY_S = 2.0, 60.0
_CLOSE_S: Final = 2.0
"""Longest time at the end of the service for the checkpoint that is being written, seconds."""
_CHECKPOINT_S: Final = 120
"""Longest time for writing a checkpoint, seconds."""
_NICE: Final = 19
_FLAGS: Final = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
_MODE: Final = 0o640
_WHY: Final = ".why"
"""Suffix of a file in which the writer of a checkpoint says why there is none."""
_DEPTH: Final = 100_000
_BETWEEN_S: Final = 30.0
"""Shortest time between two files of the black box, seconds."""
_INCIDENTS: Final = {
    EventKind.WATCHDOG: 700,
    EventKind.EMERGENCY: 500,
    EventKind.INTRUDER: 1,
    EventKind.BUS: 800,
}
"""Least severity of the events around which the ring is written out, by their kind."""
_DONE, _FAILED, _DIALOGUE, _TOO_LARGE = 0, 1, 3, 4
_MB: Final = 1_000_000


def fingerprint() -> str:
    """Fingerprint of this program, by its files and their lengths: only the same can replay a recording."""
    root = Path(bridge.__file__).parent
    digest = hashlib.sha256(sys.version.encode())
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root)} {path.stat().st_size}\n".encode())
    return digest.hexdigest()


class Recorder:
    """The recorder of the service of ``site``. ``tape`` and ``alarm`` are for its core."""

    def __init__(self, site: Site) -> None:
        settings = site.recorder
        state_dir = Path(site.site.state_dir)
        self.tape = machine_tape(self._take)
        self.ring = Ring(
            state_dir / "recorder",
            settings.size_mb * _MB,
            state_dir / "black_box",
            settings.black_box_mb * _MB,
        )
        self._site = site
        self._settings = settings
        self._turns: list[bytes] = []
        self._buses: list[TapedBus] = []
        self._writes = False
        self._number = 0
        self._began: dict[int, float] = {}
        """Times at which the segments of this run have begun."""
        self._child: int | None = None
        self._retry_at = 0.0
        self._retry_s = _RETRY_S
        self._guard = Guard("recorder")
        self._core: tuple[Master, PlantView, Plant] | None = None
        self._incident: Event | None = None
        self._due = 0.0
        self._written_at = -_BETWEEN_S
        self._fault = self._why_no_checkpoint = ""

    def alarm(self) -> RecordedAlarm:
        """The alarm for the master. To be made in the main thread."""
        return RecordedAlarm(self.tape)

    def taped(self, bus: Bus) -> Bus:
        """The bus for the master."""
        taped = TapedBus(bus, self.tape)
        self._buses.append(taped)
        return taped

    def start(self, master: Master, view: PlantView, plant: Plant) -> None:
        """Begin to record this core, between two of its turns. A folder that cannot be written stops nothing:
        it is told."""
        self._core = master, view, plant
        plant.on_event(self._on_event)
        try:
            self._number = self.ring.start()
        except OSError as error:
            self._tell(error.strerror or str(error))
            return
        self._writes = True
        with self._guard:
            self._begin()

    async def run(self) -> None:
        """Write, until cancelled."""
        while True:
            await asyncio.sleep(_LOOK_S)
            # What records a plant must not end what moves it.
            with self._guard:
                self.look(clock.now())

    def close(self) -> None:
        """Write what waits, and an incident that is due."""
        self.tape.is_on = False
        if not self._writes:
            return
        end = time.monotonic() + _CLOSE_S
        while self._child is not None and time.monotonic() < end:
            self._reap()
            time.sleep(_LOOK_S / 10)
        if self._child is not None:
            os.kill(self._child, signal.SIGKILL)
            os.waitpid(self._child, 0)
        self._flush()
        if self._incident:
            self._write_out(clock.now())
        self.ring.close()

    def _take(self, turn: bytes) -> None:
        self._turns.append(turn)

    def _flush(self) -> None:
        if self._turns:
            turns, self._turns = self._turns, []
            self.ring.put(turns)

    def look(self, now: float) -> None:
        """Do what is due; called a few times a second, between two turns."""
        if not self._writes:
            return
        self._reap()
        self._flush()
        if self._incident and now >= self._due:
            self._write_out(now)
        self._tell(self._why_no_checkpoint or self.ring.fault)
        if self._child is not None or now < self._retry_at:
            return
        is_long = self.ring.is_long or now > self._began.get(self._number, now) + _SEGMENT_S
        is_broken = self.ring.has_lost or not self.tape.is_on
        # The state of a dialogue can be put into no checkpoint.
        if (is_long or is_broken) and self._core and not self._core[0].asks:
            self._begin()

    # segments

    def _begin(self) -> None:
        """Begin a segment with a checkpoint, which a child process writes from the memory as it is now. Until
        it is there, the segment before it goes on in case there will be none."""
        assert self._core is not None
        self._flush()
        now = clock.now()
        self._retry_at = now + self._retry_s
        self._retry_s = min(2 * self._retry_s, _LONGEST_RETRY_S)
        number = self._number + 1
        header = Header(
            version=__version__,
            site=self._site.site.name,
            buses=tuple(bus.name for bus in self._site.bus),
            number=number,
            began=now,
            epoch_ns=clock.epoch_ns(now),
        )
        path, core, most = self.ring.state_path(number), self._core, self.ring.most_state
        buses = {bus.name: list(bus.facts()) for bus in self._buses}
        count = self.tape.count
        self._child = _fork(
            lambda: _write_state(
                path, header, lambda: State(fingerprint(), count, buses, checkpoint.save(core)), most
            )
        )
        self._number = number
        self._began[number] = now
        self.tape.is_on = True
        self.ring.begin(number)

    def _reap(self) -> None:
        """Look whether the checkpoint is written."""
        if self._child is None:
            return
        pid, status = os.waitpid(self._child, os.WNOHANG)
        if not pid:
            return
        self._child = None
        code = os.waitstatus_to_exitcode(status)
        self._why_no_checkpoint = ""
        if code == _TOO_LARGE:
            self._why_no_checkpoint = "the checkpoint of this site is too large for recorder.size_mb"
        elif code not in (_DONE, _DIALOGUE):
            why = self.ring.state_path(self._number).with_suffix(_WHY)
            said = why.read_text(encoding="utf-8") if why.exists() else f"its writer ended with {code}"
            why.unlink(missing_ok=True)
            self._why_no_checkpoint = f"no checkpoint could be written: {said}"
        if code == _DONE:
            self._retry_s = _RETRY_S
        else:
            self.ring.has_lost = True

    # incidents

    def _on_event(self, event: Event) -> None:
        least = _INCIDENTS.get(event.kind)
        if least is not None and event.severity >= least and not self._incident:
            self._incident = event
            self._due = max(event.time + self._settings.after_s, self._written_at + _BETWEEN_S)

    def _write_out(self, now: float) -> None:
        event, self._incident = self._incident, None
        assert event is not None
        self._written_at = now
        since = event.time - self._settings.before_s
        later = [number for number, began in self._began.items() if began > since]
        first = max((number for number in self._began if number not in later), default=min(later, default=0))
        at = datetime.fromtimestamp(clock.epoch_ns(event.time) / 1e9, UTC)
        source = event.source.replace("/", "-")
        name = f"{at:%Y%m%dT%H%M%SZ}-{event.kind}-{source}"
        self._began = {number: began for number, began in self._began.items() if number >= first}
        self.ring.keep(sorted(self._began), name)
        _log.info("black box: %s: %s", name, event.message)

    def _tell(self, fault: str) -> None:
        if fault == self._fault or self._core is None:
            return
        self._fault = fault
        said = Text.of("recorder.written_again")
        if fault:
            said = Text.of("recorder.not_written", folder=str(self.ring.folder), error=Text.plain(fault))
        severity = 600 if fault else 300
        plant = self._core[2]
        plant.report(Event(clock.now(), EventKind.CONFIGURATION, "bridge", severity, said))


def _fork(work: Callable[[], int]) -> int:
    """A child process that does ``work`` with the memory as it is now, and ends with what it returns."""
    pid = os.fork()
    if pid:
        return pid
    code = _FAILED
    try:
        # First: what it has open keeps no burst alive, and no client's connection, when the service ends.
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        gc.disable()
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        signal.alarm(_CHECKPOINT_S)
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.nice(_NICE)
        sys.setrecursionlimit(_DEPTH)
        code = work()
    finally:
        os._exit(code)


def _write_state(path: Path, header: Header, make: Callable[[], State], most: float) -> int:
    try:
        state = make()
    except checkpoint.DialogueIsOn:
        return _DIALOGUE
    except Unusable as error:
        path.with_suffix(_WHY).write_text(str(error), encoding="utf-8")
        return _FAILED
    chunks = header_chunk(header) + state_chunk(state)
    if len(chunks) > most:
        return _TOO_LARGE
    part = path.with_suffix(".part")
    with os.fdopen(os.open(part, _FLAGS, _MODE), "wb") as file:
        file.write(chunks)
    part.replace(path)
    return _DONE
