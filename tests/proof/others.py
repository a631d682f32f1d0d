"""Others on the bus and at the ports: a second sender, a second bridge, a drive made deaf, a client that
writes ahead, a port that is taken."""

from __future__ import annotations

import math
import signal
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

from tests.proof import acts, bounds, machine
from tests.proof.board import NUMBERS
from tests.proof.drives import (
    BRIDGE_SIDE,
    CLIENT_MS,
    DRIVE_SIDE,
    DRIVES,
    IGNORED_STOP_MS,
    PORTS,
    SERVERS,
    TPDO_MS,
    Drive,
    drives_of,
    write_second_site,
)
from tests.proof.families import CIA402
from tests.proof.rig import BRIDGE_HEARTBEAT, NMT, Rig, Stuck
from tests.proof.settings import PLANT
from tests.proof.strangers import Connection

VICTIM: Final = next(drive for drive in DRIVES if drive.family is CIA402)
"""Whose RPDO is not heard any more, or sent by somebody else. It watches our heartbeat, so it goes on."""
_INTRUDES_S: Final = 0.02
_MASTERS_S: Final = 3.0
_LEADS_S: Final = max(0.05, 1.2 * PLANT.rpdo_period_ms / 1000)
"""Each word of an intruder that leads a drive lasts until the next SYNC."""
_DOWN_S: Final = 20.0
_AHEAD: Final = 100
_WAITS_S: Final = min(0.25, PLANT.short_s)
_ACCEPTED_S: Final = PLANT.fieldbus_timeout_ms / 2000
_FED_S: Final = 0.1
_STARTS_S: Final = 120.0
_NEVER_SENT: Final = 0x7FF
_JOG_STOPS_S: Final = 1.3
_JOG_RUNS_S: Final = 0.8
"""Two TPDOs tell that it runs steadily."""
_RAMP_SEEN_MS: Final = VICTIM.way_ms + 100
"""From then on a stop counts."""
_LOOKED_AT_MS: Final = 50
"""The owner looks for a new word so late, at the most."""
_SEEN_MS: Final = _JOG_STOPS_S * 1000 - _RAMP_SEEN_MS - TPDO_MS - _LOOKED_AT_MS - CLIENT_MS
"""Of a stop, on a slow machine; no stop is long enough to be judged by itself."""
_JOGS: Final = math.ceil(IGNORED_STOP_MS / _SEEN_MS)
_OPERATIONAL: Final = b"\x05"
_PRE_OPERATIONAL: Final = b"\x7f"
_BOOT_UP: Final = b"\0"
_START, _STOP = 0x01, 0x02


class Intruder:
    """Sends a drive's RPDO with a word that enables, beside the bridge. With ``is_master`` it starts the node
    before each of them, and leads the drive: while that is not enabled, it gets the word that makes it ready
    and the one that enables by turns."""

    def __init__(self, rig: Rig, drive: Drive, *, is_master: bool = False) -> None:
        self._rig = rig
        self._drive = drive
        self._start = bytes((_START, drive.node_id)) if is_master else b""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="intruder")
        self.since = self._send(drive.family.run)
        self._thread.start()

    def _send(self, word: int) -> float:
        # None of the setpoints that its owner writes: on the wire what another device sends bears no mark of
        # this host, here nothing but the data tells it from what the bridge has sent a moment ago.
        setpoint = self._drive.family.setpoint + NUMBERS
        data = word.to_bytes(2, "little") + setpoint.to_bytes(2, "little")
        return machine.send(BRIDGE_SIDE, self._drive.rpdo, data)

    def _word(self) -> int:
        family = self._drive.family
        said = self._rig.said.last(self._drive.tpdo)
        leads = self._start and not (said and self._drive.enabled(said.data))
        return family.ready if leads and int(time.monotonic() / _LEADS_S) % 2 else family.run

    def _run(self) -> None:
        while not self._ended.wait(_INTRUDES_S):
            with suppress(OSError):
                if self._start:
                    machine.send(BRIDGE_SIDE, NMT, self._start)
                self._send(self._word())

    def end(self) -> None:
        self._ended.set()
        self._thread.join(1.0)


def intrude(rig: Rig) -> float:
    intruder = Intruder(rig, VICTIM)
    rig.guests.callback(intruder.end)
    return intruder.since


def intrude_as_master(rig: Rig) -> float:
    """It starts the drive again and again, until it ends."""
    intruder = Intruder(rig, VICTIM, is_master=True)
    time.sleep(_MASTERS_S)
    intruder.end()
    time.sleep(answered(rig, VICTIM) / 1000)
    return intruder.since


def answered(rig: Rig, drive: Drive) -> float:
    """The drive may run until the answer, which has a published bound. Its TPDOs tell of that, or the
    heartbeat of a node that is stopped, which comes as often."""
    return rig.intruder_ms + TPDO_MS


def pause_beside_twin(rig: Rig) -> float:
    """The bridge stands still, and a frame of a second one waits for it. Its content is none of what the
    bridge itself has sent lately: on this host only that tells it from the bridge's own."""
    assert rig.bridge
    now = rig.stand_still()
    time.sleep(PLANT.paused_s)
    machine.send(BRIDGE_SIDE, BRIDGE_HEARTBEAT, _PRE_OPERATIONAL)
    rig.bridge.signal(signal.SIGCONT)
    return now


def owed_stop(rig: Rig, drive: Drive, moment: float) -> str:
    """Finding on a bridge that gives way without stopping the drive's node, before its next boot-up message;
    empty where it does."""
    beats = rig.told.runs(BRIDGE_HEARTBEAT, moment)
    back = min((beat.first for beat in beats if beat.data == _BOOT_UP), default=math.inf)
    stops = [bytes((_STOP, node_id)) for node_id in (0, drive.node_id)]
    commands = [run for run in rig.told.runs(NMT, moment) if run.first < back]
    return "" if any(run.data in stops for run in commands) else "the bridge gave way without its NMT stop"


def end_intruder(rig: Rig) -> None:
    rig.send_guests_away()
    machine.reset_nodes(VICTIM.node_id)


def make_deaf(rig: Rig) -> None:
    """Its RPDO waits for a SYNC that never comes (1005h), and the bridge does not hear of it."""
    rig.gateway.silence_drives()
    machine.download(DRIVE_SIDE, VICTIM.node_id, 0x1005, _NEVER_SENT)
    rig.gateway.restore()


def ignored_drive(rig: Rig, drive: Drive) -> float:
    """The bridge stops the node of one that does not follow."""
    ignored_ms = IGNORED_STOP_MS + PLANT.heartbeat_ms if drive is VICTIM else 0.0
    return bounds.controller_drive(rig, drive) + ignored_ms


def jog(rig: Rig) -> float:
    """Its owner lets it run and stops it by turns."""
    now = time.monotonic()
    for _ in range(_JOGS):
        rig.board.command(VICTIM.place, VICTIM.family.ready)
        time.sleep(_JOG_STOPS_S)
        rig.board.command(VICTIM.place, VICTIM.family.run)
        time.sleep(_JOG_RUNS_S)
    return now


def jogged(rig: Rig, drive: Drive) -> float:
    """So many stops together are an ignored one (docs/explanation/dead-man-chain.md, "Jogging")."""
    return _JOGS * (_JOG_STOPS_S + _JOG_RUNS_S) * 1000 + bounds.node_stopped(rig, drive)


def let_hear(rig: Rig) -> None:
    machine.reset_nodes(VICTIM.node_id)
    acts.continue_owners(rig)


def start_second_bridge(rig: Rig) -> None:
    """On the same bus, for the same drives, with ports of its own."""
    second = rig.guests.enter_context(rig.another_bridge(write_second_site(rig.folder, rig.other_nodes)))
    # It gives way, or it does not.
    said = ("another bridge is in charge", "node operational")
    rig.wait(lambda: any(text in second.output() for text in said), _STARTS_S, "the second bridge listens")


def end_second_bridge(rig: Rig) -> None:
    rig.send_guests_away()
    acts.continue_owners(rig)


def restart_unbooted(rig: Rig) -> float:
    """The bridge dies, and a drive that is kept running by its heartbeat hears the next one, which hears of
    it no more than that it is there: no SDO is answered. Gives the time of that one's first heartbeat."""
    acts.stop_owners(rig)
    rig.gateway.pass_only(0x700 + VICTIM.node_id)
    rig.guests.enter_context(machine.repeat(DRIVE_SIDE, BRIDGE_HEARTBEAT, _OPERATIONAL, _FED_S))
    killed = rig.kill_bridge()
    rig.renew_bridge()
    since = killed + PLANT.deadman_ms / 1000
    rig.wait(lambda: bool(rig.told.times(BRIDGE_HEARTBEAT, since)), _STARTS_S, "the bridge acts")
    return rig.told.times(BRIDGE_HEARTBEAT, since)[0]


def let_boot(rig: Rig) -> None:
    rig.send_guests_away()
    rig.gateway.open()
    machine.reset_nodes(VICTIM.node_id)
    acts.continue_owners(rig)


def write_ahead(rig: Rig) -> float:
    """A client takes the place of the Modbus owner, which has ended. While the bridge stands still for less
    than its dead-man time, it writes hundreds of telegrams without waiting for an answer, and hangs. Gives
    the time of the last one."""
    assert rig.bridge
    rig.owners["modbus"].kill()
    connections: dict[Drive, Connection] = {}
    for drive in drives_of("modbus"):
        if drive.reaction != "hold":
            connections[drive] = Connection.of_owner()
            rig.guests.callback(connections[drive].abandon)
    _take_over(rig, connections)
    rig.bridge.signal(signal.SIGSTOP)
    for drive, connection in connections.items():
        connection.write_ahead(drive, _AHEAD)
    moment = time.monotonic()
    time.sleep(_WAITS_S)
    rig.bridge.signal(signal.SIGCONT)
    return moment


def _take_over(rig: Rig, connections: dict[Drive, Connection]) -> None:
    """Another connection of the owner's machine owns its drives as soon as the bridge has seen the end of the
    owner's; before that it is refused."""

    def takes_over() -> bool:
        answers = [
            connection.write(drive, 0, drive.family.run, drive.family.setpoint)
            for drive, connection in connections.items()
        ]
        return not any(answers)

    rig.wait(takes_over, _ACCEPTED_S, "the bridge sees the end of the owner's connections")


def stop_writing_ahead(rig: Rig) -> None:
    rig.send_guests_away()
    rig.owners["modbus"].start()


def kill_front_and_keep_it_down(rig: Rig) -> float:
    """Its further starts fail, with a damaged key. Nobody can have its port, which the service holds."""
    key = _own_key(rig)
    key.rename(key.with_name("kept"))
    key.write_text("-----BEGIN", encoding="ascii")
    moment = acts.signal_front("opcua", signal.SIGKILL)(rig)
    taker = rig.guests.enter_context(socket.socket())
    taker.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        taker.bind((SERVERS["opcua"], PORTS["opcua"]))
        taker.listen()
    except OSError:
        return moment
    raise Stuck("the port of a front that is away could be taken")


def _own_key(rig: Rig) -> Path:
    return rig.disk.folder / "state" / "certificates" / "own" / "own_key.pem"


def let_front_up(rig: Rig) -> None:
    """After a while, in which the service may not end."""
    assert rig.bridge
    time.sleep(_DOWN_S)
    key = _own_key(rig)
    key.with_name("kept").replace(key)
    if rig.bridge.popen.poll() is not None:
        raise Stuck("the service has ended: a front could not start")
    rig.send_guests_away()
    acts.wait_front("opcua")(rig)
