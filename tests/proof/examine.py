"""Faults that are judged by yes or no: what an answer claims against what the bus shows, and what nobody but
the owner may do to a drive that runs, or to outputs."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from tests.proof import measure
from tests.proof.asker import Asker
from tests.proof.block import BLOCK, Block, BlockOwner
from tests.proof.board import NUMBERS
from tests.proof.drives import BRIDGE_SIDE, CLIENT_MS, DRIVES, Drive, drives_of
from tests.proof.measure import Span
from tests.proof.rig import BRIDGE, Rig
from tests.proof.settings import PLANT, REACTION_MS
from tests.proof.strangers import Connection
from tests.proof.witness import Witness

_BURST_S: Final = 0.1
"""How long a stop may break a silence (docs/explanation/dead-man-chain.md)."""
_SILENT_S: Final = max(0.1, 3 * PLANT.rpdo_period_ms / 1000)
_TRIPS_S: Final = PLANT.fieldbus_timeout_ms / 1000 + 2.0
_AT_ONCE_MS: Final = CLIENT_MS + PLANT.rpdo_period_ms + REACTION_MS
_LOOKS_S: Final = _AT_ONCE_MS / 1000 + _BURST_S + PLANT.deadman_ms / 1000
"""After it everything has happened that a request may bring about, the kernel's last burst included."""
_TURNS: Final = 10
_TURN_S: Final = 0.05
_EVENT_S: Final = 2.0
_CYCLES: Final = 4
_NOT_ALLOWED: Final = 1
"""Modbus exception "illegal function": docs/reference/outcomes.md."""
_REFUSALS: Final = ("not_allowed", "read_only")
_SDO_REQUEST: Final = 0x600
_DOWNLOADS: Final = (1, 6)
"""SDO commands of a client: initiate download, block download (CiA 301 §7.2.4.3)."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Of one drive or block: what is ``wrong``, empty where nothing is; where a stop was asked for, from when
    on (``asked``) and when it was on the bus (``stopped``)."""

    of: Drive | Block
    wrong: str = ""
    asked: float = 0.0
    stopped: float | None = None

    @property
    def spans(self) -> list[Span]:
        if self.stopped is None:
            return []
        return [Span(self.asked, self.stopped, _AT_ONCE_MS, (BRIDGE,))]


Examine = Callable[[Rig], list[Finding]]


def _first(texts: Sequence[str]) -> str:
    return next((text for text in texts if text), "")


# an answer is true


def stop_in_silence(rig: Rig) -> list[Finding]:
    """The owner falls silent, the bridge with it, and somebody else asks for stops."""
    return [_asked_in_silence(rig, drive) for drive in DRIVES if drive.reaction == "silence"]


def _asked_in_silence(rig: Rig, drive: Drive) -> Finding:
    with Asker() as asker:
        rig.owners[drive.protocol].signal(signal.SIGSTOP)
        rig.wait(lambda: _is_silent(rig, drive), _TRIPS_S, f"{drive.path} gets nothing")
        begin = time.monotonic()
        wrong = _breaks(rig, drive, asker, "quick_stop")
        end = next(iter(rig.told.times(drive.rpdo, begin)), None)
        others = (
            _again(rig, drive, asker, "quick_stop"),
            _breaks(rig, drive, asker, "disable_voltage"),
            _again(rig, drive, asker, "disable_voltage"),
        )
    return Finding(drive, _first((wrong, *others)), begin, end)


def _is_silent(rig: Rig, drive: Drive) -> bool:
    told = rig.told.last(drive.rpdo)
    return told is not None and time.monotonic() - told.last > _SILENT_S


def _breaks(rig: Rig, drive: Drive, asker: Asker, command: str) -> str:
    """A stop that was not sent in this silence yet: it goes out, its answer says so, and the silence is back
    then."""
    since = time.monotonic()
    answer = asker.command(drive.path, command)
    time.sleep(_LOOKS_S)
    times = rig.told.times(drive.rpdo, since)
    if answer.code or not answer.forwarded:
        return f"{command} in its silence was answered {answer}"
    if not times:
        return f"{command} in its silence was answered forwarded, and not one frame was sent"
    mask, value = drive.family.stops[command]
    for run in rig.told.runs(drive.rpdo, times[0]):
        if drive.control_word(run.data) & mask != value:
            return f"{command} in its silence sent {run.data.hex()}"
    if times[-1] - times[0] > _BURST_S + PLANT.deadman_ms / 1000:
        return f"{command} ended its silence: frames for {times[-1] - times[0]:.2f} s"
    return ""


def _again(rig: Rig, drive: Drive, asker: Asker, command: str) -> str:
    """One that was sent in this silence already: it goes out at most once more, with the other word that is
    due where the drive has come to rest meanwhile; each answer says whether it did."""
    sent, again = {rig.told.runs(drive.rpdo, 0.0)[-1].data}, set[bytes]()
    for _ in range(2):
        since = time.monotonic()
        answer = asker.command(drive.path, command)
        time.sleep(_LOOKS_S)
        runs = rig.told.runs(drive.rpdo, since)
        if answer.code or answer.forwarded != bool(runs):
            return f"{command} again was answered {answer}, and {len(runs)} words were sent"
        again = {run.data for run in runs}
        if again & sent:
            return f"{command} broke its silence again, by the same word {runs[0].data.hex()}"
        sent |= again
    return f"{command} breaks its silence again and again" if again else ""


def continue_silent(rig: Rig) -> None:
    for protocol in {drive.protocol for drive in DRIVES if drive.reaction == "silence"}:
        rig.owners[protocol].signal(signal.SIGCONT)


# nobody but the owner


def alternate(rig: Rig) -> list[Finding]:
    """A second connection of the owner's address stops and runs its drives by turns."""
    drives = drives_of("modbus")
    connection = Connection.of_owner()
    codes: dict[Drive, list[int]] = {drive: [] for drive in drives}
    with Asker() as asker:
        asker.hear_refusals()
        since = time.monotonic()
        for _ in range(_TURNS):
            for drive in drives:
                for word in (drive.family.ready, drive.family.run):
                    codes[drive].append(connection.write(drive, 0, word, drive.family.setpoint + NUMBERS))
            time.sleep(_TURN_S)
        time.sleep(_SILENT_S)
        ends = time.monotonic() + _EVENT_S
        while len(named := _named(asker.refusals, f"port {connection.port}")) < len(drives):
            if time.monotonic() > ends:
                break
            time.sleep(_TURN_S)
    connection.close()
    return [
        Finding(
            drive,
            _first(
                (
                    _refused(codes[drive]),
                    measure.held(rig, drive, since),
                    _took_setpoint(rig, drive, since),
                    "" if drive.path in named else "no event names the second connection",
                )
            ),
        )
        for drive in drives
    ]


def _named(events: list[str], who: str) -> set[str]:
    """The drives of which an event names ``who``."""
    told = map(json.loads, list(events))
    return {event["source"] for event in told if who in event["message"]}


def _refused(codes: list[int]) -> str:
    others = [code for code in codes if code != _NOT_ALLOWED]
    return f"{len(others)} of {len(codes)} writes were answered {others[0]}" if others else ""


def _took_setpoint(rig: Rig, drive: Drive, since: float) -> str:
    runs = rig.told.runs(drive.number_id, since)
    is_taken = any(run.last > since and drive.telegram(run.data) >= NUMBERS for run in runs)
    return "it got the setpoint of the second connection" if is_taken else ""


def acknowledge_after_stop(rig: Rig) -> list[Finding]:
    """Somebody stops the drives of an owner that acknowledges in each cycle and goes on enabling."""
    drives = drives_of("modbus")
    asked: dict[Drive, float] = {}
    wrong: dict[Drive, str] = {}
    with Asker() as asker:
        for drive in drives:
            asked[drive] = time.monotonic()
            answer = asker.command(drive.path, "stop")
            wrong[drive] = "" if answer.forwarded and not answer.code else f"stop was answered {answer}"
    for _ in range(_CYCLES):
        for acknowledges in (True, False):
            for drive in drives:
                family = drive.family
                edge = family.acknowledge & ~family.ready if acknowledges else 0
                rig.board.command(drive.place, family.run | edge)
            time.sleep(PLANT.owner_period_s)
    return [_stays_stopped(rig, drive, asked[drive], wrong[drive]) for drive in drives]


def _stays_stopped(rig: Rig, drive: Drive, asked: float, wrong: str) -> Finding:
    stop = measure.bus_stop(rig, drive, asked, silent=False)
    if stop is None:
        return Finding(drive, wrong or "it was not stopped")
    own = measure.drive_stop(rig, drive, asked) or rig.now()
    again = measure.was_enabled(rig, drive, stop[0], own)
    return Finding(drive, wrong or ("an acknowledge took the stop back" if again else ""), asked, stop[0])


def set_what_moves(rig: Rig) -> list[Finding]:
    """Somebody who is no engineer sets, as parameters, what moves the drives that run and what stops them."""
    drives = [drive for drive in DRIVES if drive.family.reserved]
    nodes = {drive.node_id for drive in drives}
    requests = Witness(BRIDGE_SIDE, [_SDO_REQUEST + node_id for node_id in nodes], rig.clock)
    since = time.monotonic()
    try:
        with Asker() as asker:
            wrong = {drive: _sets(drive, asker) for drive in drives}
        time.sleep(_LOOKS_S)
        return [
            Finding(
                drive,
                _first((wrong[drive], _was_written(requests, drive, since), measure.held(rig, drive, since))),
            )
            for drive in drives
        ]
    finally:
        requests.close()


def _sets(drive: Drive, asker: Asker) -> str:
    answers = [(one, asker.set_parameter(drive.path, one.name, one.value)) for one in drive.family.reserved]
    return _first(
        [
            f"{one.name} = {one.value} was answered {answer}"
            for one, answer in answers
            if answer.code not in _REFUSALS
        ]
    )


def _was_written(requests: Witness, drive: Drive, since: float) -> str:
    """The bridge itself writes nothing to a node in operation."""
    written = [
        run.data
        for run in requests.runs(_SDO_REQUEST + drive.node_id, since)
        if run.data[0] >> 5 in _DOWNLOADS
    ]
    return f"it was written: SDO request {written[0].hex()}" if written else ""


# outputs


def stop_of_held_outputs(rig: Rig) -> list[Finding]:
    """Outputs whose owner is silent, one of which is to hold then; and somebody asks for a stop."""
    with BlockOwner(rig) as owner:
        owner.activate()
        rig.wait(lambda: owner.sent() == BLOCK.held, _TRIPS_S, "the outputs of a silent owner hold")
        with Asker() as asker:
            asked = time.monotonic()
            answer = asker.command(BLOCK.path, "stop")
            time.sleep(_LOOKS_S)
        wrong = "" if answer.forwarded and not answer.code else f"stop was answered {answer}"
        end = owner.safe_since(asked)
        if not wrong and end is None:
            wrong = f"stop was answered forwarded, and {owner.sent().hex()} is sent on"
        return [Finding(BLOCK, wrong, asked, end)]


def acknowledge_after_stop_of_outputs(rig: Rig) -> list[Finding]:
    """Somebody stops the outputs of an owner that acknowledges in each cycle and repeats its telegram."""
    with BlockOwner(rig) as owner:
        owner.activate()
        with Asker() as asker:
            asked = time.monotonic()
            answer = asker.command(BLOCK.path, "stop")
        wrong = "" if answer.forwarded and not answer.code else f"stop was answered {answer}"
        for _ in range(_CYCLES):
            owner.acknowledge()
            owner.write(BLOCK.active)
            time.sleep(PLANT.owner_period_s)
        end = owner.safe_since(asked)
        if not wrong and end is None:
            wrong = "an acknowledge took the stop back"
        # They come back by what is asked for: else this would prove nothing.
        owner.write(BLOCK.safe)
        owner.activate()
        return [Finding(BLOCK, wrong, asked, end)]
