"""The faults: how each is brought about and undone, from when its time counts, and its bound."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from tests.proof import machine
from tests.proof.drives import (
    BRIDGE_SIDE,
    DEADMAN_MS,
    DRIVE_SIDE,
    DRIVES,
    PROTOCOLS,
    REACTION_MS,
    RPDO_PERIOD_MS,
    SERVERS,
    TPDO_MS,
    Drive,
)
from tests.proof.rig import Rig

Reference = Literal["telegram", "moment", "sign of life", "boot-up"]

_BLOCKED_S: Final = 1.0
_HOUR_S: Final = 3600.0
_FRONT_S: Final = 90.0


@dataclass(frozen=True, slots=True)
class Fault:
    """``inject`` gives the moment of the fault, in seconds of the monotonic clock. Drives of other protocols
    than ``protocols`` are to go on. ``steady``: what of the fault is to stop no drive comes first.
    ``at_once``: to how many owners, connections or nodes a round does it; each of them counts."""

    name: str
    reference: Reference
    inject: Callable[[Rig], float]
    undo: Callable[[Rig], None]
    bus_bound: Callable[[Rig, Drive], float]
    drive_bound: Callable[[Rig, Drive], float] | None
    protocols: tuple[str, ...] = PROTOCOLS
    steady: Callable[[Rig], None] | None = None
    possible: Callable[[], bool] = lambda: True
    at_once: int = 1

    def rounds(self, times: int) -> int:
        """How many rounds inject it at least ``times`` times."""
        return -(-times // self.at_once)

    def is_due(self, cycle: int, cycles: int) -> bool:
        """Whether it has a round in this one of ``cycles``, over which its rounds are spread evenly."""
        rounds = self.rounds(cycles)
        return (cycle + 1) * rounds // cycles > cycle * rounds // cycles

    @property
    def leaves_silence(self) -> bool:
        """The bridge cannot answer it with a stop: it is gone, or its bus is."""
        return self.reference == "moment"


# bounds, in ms


def _controller(rig: Rig, drive: Drive) -> float:
    return rig.worst_case_ms[drive]


def _controller_drive(rig: Rig, drive: Drive) -> float:
    return rig.worst_case_ms[drive] + TPDO_MS


def _dead(rig: Rig, drive: Drive) -> float:
    return DEADMAN_MS


def _dead_drive(rig: Rig, drive: Drive) -> float:
    return rig.worst_case_bridge_ms[drive] + TPDO_MS


def _at_once(rig: Rig, drive: Drive) -> float:
    return RPDO_PERIOD_MS + REACTION_MS


def _at_once_drive(rig: Rig, drive: Drive) -> float:
    return _at_once(rig, drive) + drive.family.own_timeout_ms + TPDO_MS


def _lost(rig: Rig, drive: Drive) -> float:
    return drive.family.lost_after_ms + RPDO_PERIOD_MS + REACTION_MS


def _lost_drive(rig: Rig, drive: Drive) -> float:
    return _lost(rig, drive) + TPDO_MS


# what is done


def _signal_owners(number: signal.Signals) -> Callable[[Rig], float]:
    def inject(rig: Rig) -> float:
        now = time.monotonic()
        for owner in rig.owners.values():
            owner.signal(number)
        return now

    return inject


def _stop_owners(rig: Rig) -> float:
    return _signal_owners(signal.SIGSTOP)(rig)


def _continue_owners(rig: Rig) -> None:
    _signal_owners(signal.SIGCONT)(rig)


def _new_owners(rig: Rig) -> None:
    for owner in rig.owners.values():
        owner.start()


def _cut(rig: Rig) -> float:
    now = time.monotonic()
    machine.cut_networks(list(SERVERS.values()))
    return now


def _uncut(rig: Rig) -> None:
    machine.restore_networks(list(SERVERS.values()))


def _vanish(rig: Rig) -> float:
    """The owners' machine is switched off: no FIN, no RST, nothing; the bridge keeps their connections."""
    now = _cut(rig)
    _signal_owners(signal.SIGKILL)(rig)
    return now


def _come_back(rig: Rig) -> None:
    _uncut(rig)
    _new_owners(rig)


def _signal_front(number: signal.Signals) -> Callable[[Rig], float]:
    def inject(rig: Rig) -> float:
        now = time.monotonic()
        os.kill(rig.front, number)
        return now

    return inject


def _wait_front(rig: Rig) -> None:
    """The owners stand still meanwhile: on one CPU a front takes twice as long to start beside them."""
    before = rig.fronts_started()
    _stop_owners(rig)
    rig.wait(lambda: rig.fronts_started() > before, _FRONT_S, "the front is back")
    _continue_owners(rig)


def _renew_bridge(rig: Rig) -> None:
    _stop_owners(rig)
    rig.renew_bridge()
    _continue_owners(rig)


def _continue_front(rig: Rig) -> None:
    _signal_front(signal.SIGCONT)(rig)


def _stop_bridge(rig: Rig) -> float:
    assert rig.bridge
    now = time.monotonic()
    rig.bridge.signal(signal.SIGSTOP)
    time.sleep(_BLOCKED_S)
    return now


def _continue_bridge(rig: Rig) -> None:
    assert rig.bridge
    rig.bridge.signal(signal.SIGCONT)


def _block_loop(rig: Rig) -> float:
    """The thread of the event loop alone stands still; zenoh's threads and the front go on."""
    assert rig.bridge
    return machine.block_thread(rig.bridge.pid, _BLOCKED_S)


def _nothing(rig: Rig) -> None:
    pass


def _full(rig: Rig) -> None:
    rig.disk.fill()


def _empty(rig: Rig) -> None:
    rig.disk.empty()
    _continue_owners(rig)


def _step_clock(rig: Rig) -> None:
    """Forwards and backwards by turns."""
    rig.hours = -rig.hours
    machine.step_clock(rig.hours * _HOUR_S)
    rig.clock.stepped()


def _link_down(rig: Rig) -> float:
    return machine.set_link(BRIDGE_SIDE, up=False)


def _link_up(rig: Rig) -> None:
    machine.set_link(BRIDGE_SIDE, up=True)


def _bus_off(rig: Rig) -> float:
    return machine.bus_off()


def _bus_restarted(rig: Rig) -> None:
    machine.bus_restarted()


def _silence(rig: Rig) -> float:
    rig.gateway.silence_drives()
    return time.monotonic()


def _speak(rig: Rig) -> None:
    rig.gateway.restore()


def _reboot(rig: Rig) -> float:
    """NMT reset node, to all; the bridge does not see it (``machine.FROM_DRIVES``)."""
    return machine.send(DRIVE_SIDE, 0x000, bytes((0x81, 0x00)))


_KILL: Final = signal.SIGKILL
_OF_OWNERS: Final = (_controller, _controller_drive)
_OWNERS: Final = len(PROTOCOLS)
_NODES: Final = len({drive.node for drive in DRIVES})
FAULTS: Final = (
    Fault("owner stopped", "telegram", _stop_owners, _continue_owners, *_OF_OWNERS, at_once=_OWNERS),
    Fault("owner killed", "telegram", _signal_owners(_KILL), _new_owners, *_OF_OWNERS, at_once=_OWNERS),
    Fault("network cut", "telegram", _cut, _uncut, *_OF_OWNERS, at_once=_OWNERS),
    Fault("half-open connection", "telegram", _vanish, _come_back, *_OF_OWNERS, at_once=_OWNERS),
    Fault("disk full", "telegram", _stop_owners, _empty, *_OF_OWNERS, steady=_full),
    Fault(
        "clock stepped by an hour",
        "telegram",
        _stop_owners,
        _continue_owners,
        *_OF_OWNERS,
        steady=_step_clock,
        possible=machine.is_user_mode,
    ),
    Fault(
        "front stopped",
        "telegram",
        _signal_front(signal.SIGSTOP),
        _continue_front,
        *_OF_OWNERS,
        protocols=("opcua",),
    ),
    Fault("node silent", "sign of life", _silence, _speak, _lost, _lost_drive, at_once=_NODES),
    Fault("bus process stopped", "moment", _stop_bridge, _continue_bridge, _dead, _dead_drive),
    Fault("bus process killed", "moment", Rig.kill_bridge, _renew_bridge, _dead, _dead_drive),
    Fault("event loop blocked for 1 s", "moment", _block_loop, _nothing, _dead, _dead_drive),
    Fault("interface down", "moment", _link_down, _link_up, _at_once, _at_once_drive),
    Fault("bus-off", "moment", _bus_off, _bus_restarted, _at_once, _at_once_drive),
    Fault("node rebooting", "boot-up", _reboot, _nothing, _lost, None, at_once=_NODES),
    Fault(
        "front killed",
        "telegram",
        _signal_front(_KILL),
        _wait_front,
        *_OF_OWNERS,
        protocols=("opcua",),
    ),
)
"""In the order of a cycle. A service that is started anew in the middle has forgotten which nodes it has lost
again and again, and how often its front has ended: it waits for neither longer than it has to."""
