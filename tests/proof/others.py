"""Others on the bus and at the ports: a second sender, a second bridge, a drive made deaf, a client that
writes ahead, a port that is taken."""

from __future__ import annotations

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
    DRIVE_SIDE,
    DRIVES,
    IGNORED_STOP_MS,
    PORTS,
    SERVERS,
    Drive,
    drives_of,
    write_second_site,
)
from tests.proof.families import CIA402
from tests.proof.rig import BRIDGE_HEARTBEAT, Rig, Stuck
from tests.proof.settings import PLANT
from tests.proof.strangers import Connection

VICTIM: Final = next(drive for drive in DRIVES if drive.family is CIA402)
"""Whose RPDO is not heard any more, or sent by somebody else. It watches our heartbeat, so it goes on."""
_INTRUDES_S: Final = 0.02
_MASTERS_S: Final = 1.0
_DOWN_S: Final = 20.0
_AHEAD: Final = 100
_WAITS_S: Final = min(0.25, PLANT.short_s)
_ACCEPTED_S: Final = 0.05
_FED_S: Final = 0.1
_STARTS_S: Final = 60.0
_NEVER_SENT: Final = 0x7FF
_OPERATIONAL: Final = b"\x05"
_PRE_OPERATIONAL: Final = b"\x7f"
_NMT: Final = 0x000
_START: Final = 0x01


class Intruder:
    """Sends a drive's RPDO with a word that enables, beside the bridge, and before it NMT start if it is a
    master."""

    def __init__(self, drive: Drive, *, is_master: bool = False) -> None:
        self._start = bytes((_START, drive.node_id)) if is_master else b""
        # None of the setpoints that its owner writes: on the wire what another device sends bears no mark of
        # this host, here nothing but the data tells it from what the bridge has sent a moment ago.
        setpoint = drive.family.setpoint + NUMBERS
        words = drive.family.run.to_bytes(2, "little") + setpoint.to_bytes(2, "little")
        self._frame = drive.rpdo, words
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="intruder")
        self.since = machine.send(BRIDGE_SIDE, *self._frame)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.wait(_INTRUDES_S):
            with suppress(OSError):
                if self._start:
                    machine.send(BRIDGE_SIDE, _NMT, self._start)
                machine.send(BRIDGE_SIDE, *self._frame)

    def end(self) -> None:
        self._ended.set()
        self._thread.join(1.0)


def intrude(rig: Rig) -> float:
    intruder = Intruder(VICTIM)
    rig.guests.callback(intruder.end)
    return intruder.since


def intrude_as_master(rig: Rig) -> float:
    """For as long as the drive may come back; it has to be stopped when that ends, and to stay so."""
    intruder = Intruder(VICTIM, is_master=True)
    time.sleep(_MASTERS_S)
    intruder.end()
    return time.monotonic()


def pause_beside_twin(rig: Rig) -> float:
    """The bridge stands still, and a frame of a second one waits for it. Its content is none of what the
    bridge itself has sent lately: on this host only that tells it from the bridge's own."""
    assert rig.bridge
    now = time.monotonic()
    rig.bridge.signal(signal.SIGSTOP)
    time.sleep(PLANT.paused_s)
    machine.send(BRIDGE_SIDE, BRIDGE_HEARTBEAT, _PRE_OPERATIONAL)
    rig.bridge.signal(signal.SIGCONT)
    return now


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


def let_hear(rig: Rig) -> None:
    machine.reset_nodes(VICTIM.node_id)
    acts.continue_owners(rig)


def start_second_bridge(rig: Rig) -> None:
    """On the same bus, for the same drives, with ports of its own."""
    second = rig.guests.enter_context(rig.another_bridge(write_second_site(rig.folder)))
    second.wait_output("OPC UA on", _STARTS_S)


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
    """While the bridge stands still for less than its dead-man time, a client of the Modbus owner's machine
    writes hundreds of telegrams without waiting for an answer, and hangs. Gives the time of the last one."""
    assert rig.bridge
    rig.owners["modbus"].signal(signal.SIGSTOP)
    drives = [drive for drive in drives_of("modbus") if drive.reaction != "hold"]
    connections = [Connection.of_owner() for _ in drives]
    time.sleep(_ACCEPTED_S)
    rig.bridge.signal(signal.SIGSTOP)
    for connection, drive in zip(connections, drives, strict=True):
        rig.guests.callback(connection.abandon)
        connection.write_ahead(drive, _AHEAD)
    moment = time.monotonic()
    time.sleep(_WAITS_S)
    rig.bridge.signal(signal.SIGCONT)
    return moment


def stop_writing_ahead(rig: Rig) -> None:
    rig.send_guests_away()
    acts.continue_modbus(rig)


def kill_front_and_keep_it_down(rig: Rig) -> float:
    """Its further starts fail, with a damaged key. Nobody can have its port, which the service holds."""
    key = _own_key(rig)
    key.rename(key.with_name("kept"))
    key.write_text("-----BEGIN", encoding="ascii")
    moment = acts.signal_front(signal.SIGKILL)(rig)
    taker = rig.guests.enter_context(socket.socket())
    taker.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        taker.bind((SERVERS["opcua"], PORTS["opcua"]))
        taker.listen()
    except OSError:
        return moment
    raise Stuck("the port of a front that is away could be taken")


def _own_key(rig: Rig) -> Path:
    return rig.disk.folder / "state" / "opcua" / "own_key.pem"


def let_front_up(rig: Rig) -> None:
    """After a while, in which the service may not end."""
    assert rig.bridge
    time.sleep(_DOWN_S)
    key = _own_key(rig)
    key.with_name("kept").replace(key)
    if rig.bridge.popen.poll() is not None:
        raise Stuck("the service has ended: a front could not start")
    rig.send_guests_away()
    acts.wait_front(rig)
