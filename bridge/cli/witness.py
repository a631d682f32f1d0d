"""``witness``: watches the dead-man chain from outside, records every stop and reports late ones."""

from __future__ import annotations

import json
import logging
import os
import shlex
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Annotated, Final

import typer

from bridge.base.errors import BridgeError, OperationFailed, Unavailable
from bridge.cli import logs
from bridge.cli.bus_runner import AsJson
from bridge.cli.finding_text import times_of
from bridge.config import Site, load_site
from bridge.witness.findings import Alarm, AlarmKind, Finding, Sight
from bridge.witness.numbers import Numbers
from bridge.witness.plan import UnknownFamily, WatchedBus, plan
from bridge.witness.shell import CannotListen, Witness

_log = logging.getLogger(__name__)

_RECORD_BYTES: Final = 10_000_000
_RECORDS: Final = 5
_AGAIN_S: Final = 1.0
"""The command runs once a second at the most; alarms meanwhile are recorded all the same."""
_ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def witness(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="the site file of the bridge")],
    channel: Annotated[
        list[str] | None,
        typer.Option(help="BUS=INTERFACE: listen there, and not on the bridge's own interface; repeatable"),
    ] = None,
    modbus: Annotated[
        str | None, typer.Option(help="address:port of the bridge's Modbus server; default: SITE's")
    ] = None,
    frames_only: Annotated[
        bool, typer.Option("--frames-only", help="do not ask the bridge for the numbers of telegrams")
    ] = False,
    own_timeout_ms: Annotated[
        int | None,
        typer.Option(min=1, help="the drives' and nodes' own time-out, where SITE does not set it"),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="append a JSON line for each stop and each alarm to this file")
    ] = None,
    run: Annotated[
        str | None, typer.Option(help="a command that is run for an alarm: to open a contact, say")
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="end after that time")] = None,
    as_json: AsJson = False,
) -> None:
    """Watch the drives and outputs of SITE stop, from another interface or another box.

    Sends nothing to the bus. Exit code 1 where there was an alarm.
    """
    logs.set_up(verbose=False)
    table = load_site(site)
    buses = _buses(table, site, channel or [], own_timeout_ms)
    numbers = None if frames_only else _numbers(table, modbus, buses)
    teller = _Teller(record, run, as_json=as_json)
    try:
        watching = Witness(buses, numbers, teller.tell)
    except CannotListen as error:
        raise Unavailable(str(error)) from error
    try:
        for line in _promises(buses, numbers is not None):
            _log.info("%s", line)
        watching.run_until(_until(seconds))
    finally:
        watching.close()
    if teller.alarms:
        raise OperationFailed(f"{teller.alarms} alarms")


def _buses(site: Site, path: Path, channels: list[str], own_timeout_ms: int | None) -> list[WatchedBus]:
    """The buses to watch, on the interfaces that were asked for. Raises ``BadParameter``."""
    places: dict[str, str] = {}
    for text in channels:
        name, is_one, interface = text.partition("=")
        if not is_one or name not in {bus.name for bus in site.bus}:
            known = ", ".join(f"{bus.name}=INTERFACE" for bus in site.bus)
            raise typer.BadParameter(f"--channel {text!r}: {known}")
        places[name] = interface
    for bus in site.bus:
        if bus.interface != "socketcan" and bus.name not in places:
            raise typer.BadParameter(
                f"bus {bus.name} is {bus.interface}: the witness listens on SocketCAN, give "
                f"--channel {bus.name}=INTERFACE"
            )
    try:
        planned = plan(site, path.parent, own_timeout_ms=own_timeout_ms)
    except UnknownFamily as error:
        raise BridgeError(f"{path}: the witness does not know the drives of the mapping {error}") from error
    return [replace(bus, channel=places.get(bus.name, bus.channel)) for bus in planned]


def _numbers(site: Site, given: str | None, buses: list[WatchedBus]) -> Numbers | None:
    """Source of the telegrams' numbers; None where the site has no Modbus server."""
    listen = given or (site.modbus.listen if site.modbus else None)
    if listen is None:
        _log.warning("the site serves no Modbus: a silent controller is not judged, only what is on the bus")
        return None
    host, _, port = listen.rpartition(":")
    if not port.isdigit():
        raise typer.BadParameter(f"--modbus {listen!r}: give address:port")
    units = [drive.unit_id for bus in buses for drive in bus.drives]
    host = host.strip("[]")
    outputs = [one.unit_id for bus in buses for one in bus.judged_outputs]
    return Numbers({"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host), int(port), units, outputs)


def _promises(buses: list[WatchedBus], has_numbers: bool) -> list[str]:
    """The bounds for each drive, and for the outputs of each node."""
    return [one.promise(has_numbers=has_numbers) for bus in buses for one in bus.watched]


def _until(seconds: float | None) -> Callable[[float], bool]:
    """Until a signal, or the time is over."""
    ended: list[int] = []
    for number in _ENDS:
        signal.signal(number, lambda number, frame: ended.append(number))
    began = time.monotonic()
    return lambda now: bool(ended) or (seconds is not None and now >= began + seconds)


class _Teller:
    """Prints and records findings, and runs the command for alarms."""

    def __init__(self, record: Path | None, command: str | None, *, as_json: bool) -> None:
        self.alarms = 0
        self._command = shlex.split(command) if command else []
        self._as_json = as_json
        self._ran_at = float("-inf")
        self._running: subprocess.Popen[bytes] | None = None
        self._record: RotatingFileHandler | None = None
        if record:
            try:
                self._record = RotatingFileHandler(
                    record, maxBytes=_RECORD_BYTES, backupCount=_RECORDS, encoding="utf-8"
                )
            except OSError as error:
                raise BridgeError(f"{record}: {error.strerror or error}") from error

    def tell(self, finding: Finding) -> None:
        line = json.dumps(_as_dict(finding), ensure_ascii=False)
        if self._record:
            self._record.emit(logging.LogRecord("witness", logging.INFO, "", 0, line, None, None))
        print(line if self._as_json else _as_text(finding), flush=True)
        if isinstance(finding, Alarm):
            self.alarms += 1
            self._run(finding)

    def _run(self, alarm: Alarm) -> None:
        now = time.monotonic()
        is_busy = self._running is not None and self._running.poll() is None
        if not self._command or is_busy or now < self._ran_at + _AGAIN_S:
            return
        self._ran_at = now
        told = {"SOURCE": alarm.source, "KIND": alarm.kind.value, "MESSAGE": alarm.message}
        env = os.environ | {f"DRIVEBRIDGE_{name}": value for name, value in told.items()}
        try:
            self._running = subprocess.Popen(self._command, env=env, stdin=subprocess.DEVNULL)
        except OSError as error:
            _log.error("%s cannot be run: %s", self._command[0], error.strerror or error)


def _time(monotonic: float) -> str:
    age_s = time.monotonic() - monotonic
    return datetime.fromtimestamp(time.time() - age_s, UTC).isoformat(timespec="milliseconds")


def _as_dict(finding: Finding) -> dict[str, object]:
    if isinstance(finding, Alarm):
        return {
            "time": _time(finding.time),
            "alarm": finding.kind.value,
            "source": finding.source,
            "message": finding.message,
        }
    if isinstance(finding, Sight):
        return {"time": _time(finding.time), "sees": finding.source, "message": finding.message}
    return {
        "time": _time(finding.time),
        "stop": finding.drive,
        "cause": finding.cause.value,
        "bus_ms": finding.bus_ms,
        "bus_bound_ms": finding.bus_bound_ms,
        "drive_ms": finding.drive_ms,
        "drive_bound_ms": finding.drive_bound_ms,
        "in_time": finding.is_in_time,
    }


def _as_text(finding: Finding) -> str:
    if isinstance(finding, Alarm):
        mark = "INTRUDER" if finding.kind is AlarmKind.INTRUDER else "ALARM"
        return f"{_time(finding.time)} {mark} {finding.source}: {finding.message}"
    if isinstance(finding, Sight):
        return f"{_time(finding.time)} sees again {finding.source}: {finding.message}"
    return f"{_time(finding.time)} stop {finding.drive}: {finding.cause}{times_of(finding)}"
