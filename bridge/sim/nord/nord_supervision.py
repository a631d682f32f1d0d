"""Supervision by a NORD node, and its reports: P151 or P513, P170, P173 (BU 2500 §7.1.1, §7.1.3, §8.1,
§8.2)."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.supervision import SignWatch
from bridge.sim.nord.nord_faults import emcy_code, register_bits


class Presence(IntEnum):
    """A drive on the system bus: its two bits in P173."""

    OFFLINE = 0
    UNKNOWN = 1
    ONLINE = 2
    LOST = 3


def module_state(nmt: SlaveState, master_lost: bool, p151_tripped: bool, drives: Sequence[Presence]) -> int:
    """P173: NMT state, time-outs, two bits per drive. The bus bits 4…7 stay 0: a simulated bus has no
    errors."""
    state = 1 if nmt is SlaveState.PRE_OPERATIONAL else 0
    state |= 2 if nmt is SlaveState.OPERATIONAL else 0
    state |= 4 if master_lost else 0
    state |= 8 if p151_tripped else 0
    for place, presence in enumerate(drives):
        state |= presence << (8 + 2 * place)
    return state


class TelegramWatch(SignWatch):
    """P151, or P513 without an interface that has parameters (§8.1): from the first valid telegram on, the
    next must come within this time."""

    def on_telegram(self, now: float) -> None:
        """A valid telegram for any drive. If the time is set later, the watch begins with the next one."""
        if self._time_s():
            self.start(now)
        else:
            self.stop()


class FaultDisplay:
    """P170: the present fault of the interface, and the last one that has gone (§8.2)."""

    def __init__(self) -> None:
        self._present: list[int] = []
        self.last = 0

    @property
    def present(self) -> int:
        return self._present[-1] if self._present else 0

    def report(self, fault_tenths: int) -> None:
        if fault_tenths not in self._present:
            self._present.append(fault_tenths)

    def clear(self, fault_tenths: int) -> None:
        """The cause is gone: the fault clears by itself and is kept as the last one."""
        if fault_tenths in self._present:
            self._present.remove(fault_tenths)
            self.last = fault_tenths

    def power_off(self) -> None:
        """A fault that is still present is lost, not archived (§8.2)."""
        self._present.clear()
        self.last = 0


class DriveFaultReporter:
    """EMCY for every drive fault that has come or gone, with the drive's id 0…3 in byte 3 (§8.3)."""

    def __init__(self, emcy: EmcyProducer, drives: int) -> None:
        self._emcy = emcy
        self._reported = [0] * drives

    def reset(self) -> None:
        self._reported = [0] * len(self._reported)
        self._emcy.error_register = 0

    def report(self, faults_tenths: Sequence[int | None]) -> bool:
        """Compare with the present fault of each drive; 0 is none, None is a drive off the system bus.

        Returns whether there is anything new.
        """
        changed = False
        for place, fault in enumerate(faults_tenths):
            if fault is None or fault == self._reported[place]:
                continue
            self._reported[place] = fault
            code = emcy_code(fault) if fault else 0
            self._emcy.report(code, self._error_register(), bytes([place]))
            changed = True
        return changed

    def _error_register(self) -> int:
        register = 0
        for fault in self._reported:
            register |= register_bits(emcy_code(fault)) if fault else 0
        return register
