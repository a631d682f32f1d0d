"""What is done to the plant, and undone."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable
from typing import Final

from tests.proof import machine
from tests.proof.board import RELEASE
from tests.proof.drives import BRIDGE_SIDE, DRIVES, SERVERS, drives_of
from tests.proof.families import NORD, NORD_INVALID
from tests.proof.rig import Rig
from tests.proof.settings import PLANT
from tests.proof.strangers import Strangers

Inject = Callable[[Rig], float]
Undo = Callable[[Rig], None]
"""Gives the moment of the fault, in seconds of the monotonic clock."""

_TIMEOUT_S: Final = PLANT.fieldbus_timeout_ms / 1000
_FLAP_S: Final = 0.05
_BEFORE_S: Final = 0.03
_SOON_S: Final = 0.001
_HANDED_ON_S: Final = 0.15
_BLOCKED_S: Final = 1.0
_HOUR_S: Final = 3600.0
_FRONT_S: Final = 90.0


def signal_owners(number: signal.Signals) -> Inject:
    def inject(rig: Rig) -> float:
        now = time.monotonic()
        for owner in rig.owners.values():
            owner.signal(number)
        return now

    return inject


def stop_owners(rig: Rig) -> float:
    return signal_owners(signal.SIGSTOP)(rig)


def continue_owners(rig: Rig) -> None:
    signal_owners(signal.SIGCONT)(rig)


def new_owners(rig: Rig) -> None:
    for owner in rig.owners.values():
        owner.start()


def cut(rig: Rig) -> float:
    now = time.monotonic()
    machine.cut_networks(list(SERVERS.values()))
    return now


def uncut(rig: Rig) -> None:
    machine.restore_networks(list(SERVERS.values()))


def vanish(rig: Rig) -> float:
    """The owners' machine is switched off: no FIN, no RST, nothing; the bridge keeps their connections."""
    now = cut(rig)
    signal_owners(signal.SIGKILL)(rig)
    return now


def come_back(rig: Rig) -> None:
    uncut(rig)
    new_owners(rig)


def signal_front(protocol: str, number: signal.Signals) -> Inject:
    def inject(rig: Rig) -> float:
        now = time.monotonic()
        os.kill(rig.front(protocol), number)
        return now

    return inject


def wait_front(protocol: str) -> Undo:
    def wait(rig: Rig) -> None:
        """The owners stand still meanwhile: on one CPU a front takes twice as long to start beside them."""
        before = rig.fronts_started(protocol)
        stop_owners(rig)
        rig.wait(lambda: rig.fronts_started(protocol) > before, _FRONT_S, "the front is back")
        rig.follow_fronts()
        continue_owners(rig)

    return wait


def renew_bridge(rig: Rig) -> None:
    stop_owners(rig)
    rig.renew_bridge()
    continue_owners(rig)


def continue_front(protocol: str) -> Undo:
    def go_on(rig: Rig) -> None:
        """Before the bridge takes it for dead, and kills it."""
        signal_front(protocol, signal.SIGCONT)(rig)

    return go_on


def stop_bridge(rig: Rig) -> float:
    now = rig.stand_still()
    time.sleep(_BLOCKED_S)
    return now


def continue_bridge(rig: Rig) -> None:
    assert rig.bridge
    rig.bridge.signal(signal.SIGCONT)


def block_loop(rig: Rig) -> float:
    """The thread of the event loop alone stands still; zenoh's threads and the front go on."""
    assert rig.bridge
    return machine.block_thread(rig.bridge.pid, _BLOCKED_S)


def nothing(rig: Rig) -> None:
    pass


def now(rig: Rig) -> float:
    return time.monotonic()


def full(rig: Rig) -> None:
    rig.disk.fill()


def empty(rig: Rig) -> None:
    rig.disk.empty()
    continue_owners(rig)


def step_clock(rig: Rig) -> None:
    """Forwards and backwards by turns."""
    rig.hours = -rig.hours
    machine.step_clock(rig.hours * _HOUR_S)
    rig.clock.stepped()


def link_down(rig: Rig) -> float:
    return machine.set_link(BRIDGE_SIDE, up=False)


def link_up(rig: Rig) -> None:
    machine.set_link(BRIDGE_SIDE, up=True)


def bus_off(rig: Rig) -> float:
    return machine.bus_off()


def bus_restarted(rig: Rig) -> None:
    machine.bus_restarted()


def silence(rig: Rig) -> float:
    rig.gateway.silence_drives()
    return time.monotonic()


def speak(rig: Rig) -> None:
    rig.gateway.restore()


def reboot(rig: Rig) -> float:
    return machine.reset_nodes()


def pause_bridge(rig: Rig) -> float:
    """Stopped and continued before anything but the dead-man time is over."""
    assert rig.bridge
    now = rig.stand_still()
    time.sleep(PLANT.paused_s)
    rig.bridge.signal(signal.SIGCONT)
    return now


def pause_as_it_sends(rig: Rig) -> float:
    """The same, at the worst moment: between its look at the clock and what it sends, when a telegram has
    come that changes it."""
    assert rig.bridge
    sent = max(rig.board.last_sent(drive.place) for drive in drives_of("modbus"))
    periods = math.ceil((time.monotonic() + _BEFORE_S - sent) / PLANT.owner_period_s)
    time.sleep(max(0.0, sent + periods * PLANT.owner_period_s - _BEFORE_S - time.monotonic()))
    return machine.block_at_timer(rig.bridge.pid, PLANT.paused_s)


def flap(rig: Rig) -> float:
    now = link_down(rig)
    time.sleep(_FLAP_S)
    link_up(rig)
    return now


def stop_owners_among_others(rig: Rig) -> float:
    rig.guests.callback(Strangers().end)
    time.sleep(_HANDED_ON_S)
    return stop_owners(rig)


def continue_owners_alone(rig: Rig) -> None:
    rig.send_guests_away()
    continue_owners(rig)


def release_drives(rig: Rig) -> float:
    """Their owner gives them back, over its own connections: no other one owns them. It looks at what it is
    to write now and then, so what counts is when it sends that."""
    places = [drive.place for drive in drives_of("modbus")]
    asked = time.monotonic()
    for place in places:
        rig.board.command(place, RELEASE)
    until = asked + _TIMEOUT_S
    while time.monotonic() < until and any(rig.board.last_sent(place) <= asked for place in places):
        time.sleep(_SOON_S)
    return max(asked, min(rig.board.last_sent(place) for place in places))


def write_run(rig: Rig) -> None:
    """The Modbus owner goes on with its word that enables."""
    for drive in drives_of("modbus"):
        rig.board.command(drive.place, drive.family.run)


def write_invalid(rig: Rig) -> float:
    """The Modbus owner goes on, with telegrams that are none."""
    now = time.monotonic()
    for drive in drives_of("modbus"):
        if drive.family is NORD:
            rig.board.command(drive.place, NORD_INVALID)
    return now


def pause_across_deadline(rig: Rig) -> float:
    """The owners fall silent, and the bridge stands still just when the first of them is to be judged."""
    assert rig.bridge
    now = stop_owners(rig)
    time.sleep(_HANDED_ON_S)
    handed_on = [run.first for drive in DRIVES if (run := rig.told.last(drive.number_id))]
    first = min(at for at in handed_on if at > now - _TIMEOUT_S)
    time.sleep(max(0.0, first + _TIMEOUT_S - _BEFORE_S - time.monotonic()))
    rig.bridge.signal(signal.SIGSTOP)
    time.sleep(PLANT.short_s)
    rig.bridge.signal(signal.SIGCONT)
    return now


def end_bridge(number: signal.Signals) -> Inject:
    def inject(rig: Rig) -> float:
        """It acts at once, and on one CPU often before the signal's sender gets its turn again."""
        assert rig.bridge
        now = time.monotonic()
        rig.bridge.signal(number)
        return now

    return inject
