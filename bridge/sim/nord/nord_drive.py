"""One NORD inverter: control word in, status word and actual values out."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Sequence
from typing import Final

from bridge.sim.core.dictionary import Dictionary, IntegerType, Number
from bridge.sim.core.dirty_flag import DirtyFlag
from bridge.sim.core.ramp import step
from bridge.sim.core.ticks import next_tick
from bridge.sim.nord.nord_faults import INTERFACE_MISSING
from bridge.sim.nord.nord_parameters import (
    PARAMETER_BASE,
    PARAMETERS,
    NordParameter,
    NordParameters,
    add_display,
)
from bridge.sim.nord.nord_posicon import approach
from bridge.sim.nord.nord_ramp import Demand, turned
from bridge.sim.nord.nord_scales import BUS_SOURCES, HUNDRED_PERCENT, LEFT, SET_POINTS, Aim, Scales
from bridge.sim.nord.nord_states import STATE_BITS, NordState, commanded

CHARGING_S: Final = 0.2
"""Power-on until the charging relay closes (transition 1); the manual gives no time."""
FAULT_REACTION_S: Final = 0.02
"""Time in seconds that state G lasts: long enough to be seen on the wire (TPDO inhibit time 10 ms)."""
COAST_S: Final = 1.0
"""The motor's run-down from P105 to standstill without voltage."""

VALID: Final = 1 << 10
ACKNOWLEDGE: Final = 1 << 7
_AT_REST: Final = (NordState.SWITCH_ON_INHIBITED, NordState.READY, NordState.SWITCHED_ON, NordState.FAULT)
"""Only a telegram leads out of these: time changes nothing."""
_IGNORE: Final = -1
"""P513 = -0.1 s."""


class NordDrive:
    """State machine, ramp, load and fault memory of one inverter (BU 2500 §6.5).

    P112 is taken as a current in ampere, because §6.5.4 scales currents with it.
    """

    def __init__(
        self,
        *,
        p105_hz: float = 50.0,
        p112_a: float = 10.0,
        ripple: float = 0.0,
        seed: int = 0,
        parameters: Sequence[NordParameter] = PARAMETERS,
    ) -> None:
        self.parameters = NordParameters(parameters)
        self.parameters.commission(105, p105_hz)
        self.parameters.commission(112, p112_a)
        self.state = NordState.NOT_READY
        self.control_word = 0
        self.setpoints: tuple[int, ...] = (0,) * SET_POINTS
        self.demand: Demand | None = None
        self.output_hz = 0.0
        self.position_increments = 0.0
        """Position of the motor's shaft; an absolute encoder may set it."""
        self.has_encoder = False
        """The position is an object of the node's own."""
        self.fault_tenths = 0
        self.warning_tenths = 0
        self.last_faults: deque[int] = deque([0] * 5, maxlen=5)
        self.digital_inputs = 0
        self.telegrams_ignored = 0
        self.dirty = DirtyFlag()
        self._ripple = ripple
        self._random = random.Random(seed)
        self._ripple_now = 0.0
        self._time = 0.0
        self._until = 0.0
        self._cause_present = False
        self._accelerating = False
        self._coast_hz = 0.0
        self._coast_at = 0.0
        self._aim_of: tuple[object, ...] = ()
        self._aim_then = self._aim

    # What the drive shows.

    @property
    def status_word(self) -> int:
        """ZSW, §6.5.2. Bits 10 and 13 (functions of P481) stay 0."""
        if self.state is NordState.NOT_READY:
            return 0  # §6.8, first line
        word = STATE_BITS[self.state] | self.control_word & 0xC000
        # Bits 4 and 5 mean that "disable voltage" and "quick stop" are not commanded. While it stops, the
        # drive has taken the command even if the master has lifted it meanwhile.
        word |= (self.control_word & 0x02) << 3 | (self.control_word & 0x04) << 3
        if self.state is NordState.QUICK_STOP:
            word = word & ~0x20 | 0x10
        word |= 0x0080 if self.warning_tenths else 0
        word |= 0x0100 if self._setpoint_reached() else 0
        word |= 0x0200 if self._aim.scales.bus_controls else 0
        left = self.output_hz < 0 or (self.output_hz == 0 and bool(self.control_word & LEFT))
        return word | (0x1000 if left else 0x0800)

    @property
    def actual_values(self) -> tuple[int, ...]:
        """IW1…IW5 as raw words."""
        return tuple(self.actual_value(n) for n in range(1, SET_POINTS + 1))

    @property
    def current_a(self) -> float:
        """A plausible motor current: magnetising, a load that grows with speed, more while accelerating."""
        if self.state not in (NordState.ENABLED, NordState.QUICK_STOP):
            return 0.0
        scales = self._aim.scales
        share = 0.35 + 0.25 * abs(self.output_hz) / scales.max_hz + (0.3 if self._accelerating else 0.0)
        return scales.rated_a * (share + self._ripple_now)

    def motor_hz(self, now: float) -> float:
        """Speed of the shaft in Hz of its field: the output's, or running down freely without voltage."""
        if self.state in (NordState.ENABLED, NordState.QUICK_STOP):
            return self.output_hz
        lost_hz = self._aim.scales.max_hz / COAST_S * (now - self._coast_at)
        left_hz = max(0.0, abs(self._coast_hz) - lost_hz)
        return left_hz if self._coast_hz > 0 else -left_hz

    def add_to(self, dictionary: Dictionary) -> None:
        """The drive's parameters and displays at 2000h + number."""
        self.parameters.add_to(dictionary)
        # P700: present fault, warning, reason for switch-on inhibit; P701: the last five faults.
        add_display(dictionary, 700, 3, lambda n: (self.fault_tenths, self.warning_tenths, 0)[n - 1])
        add_display(dictionary, 701, 5, lambda n: self.last_faults[n - 1])
        # §7.2: no display of process data when P509 is 0.
        words = 1 + SET_POINTS
        add_display(dictionary, 740, words, lambda n: self._shown((self.control_word, *self.setpoints), n))
        add_display(dictionary, 741, words, lambda n: self._shown((self.status_word, *self.actual_values), n))
        for number in (744, 748):  # options seen, state of the system bus; BU 2500 prints no bits of either
            dictionary.add(PARAMETER_BASE + number, 0, Number(IntegerType.INTEGER16, lambda: 0))

    # What happens to it.

    def power_on(self, now: float) -> None:
        self.parameters.power_on()
        self.control_word, self.setpoints, self.demand = 0, (0,) * SET_POINTS, None
        self.fault_tenths, self._cause_present = 0, False
        self._output_off(now)
        self.state, self._until, self._time = NordState.NOT_READY, now + CHARGING_S, now
        self.dirty.is_set = True

    def on_telegram(self, control_word: int, setpoints: Sequence[int]) -> bool:
        """Process data from the interface. Returns False for a telegram that is void by bit 10 (§6.5.1)."""
        if not control_word & VALID:
            self.telegrams_ignored += 1
            return False
        if not self._aim.scales.bus_controls:
            return True  # local control: the telegram is valid, but somebody else commands
        if self.parameters.raw(510) in (0, *BUS_SOURCES):
            words = tuple(setpoints[:SET_POINTS]) + (0,) * (SET_POINTS - len(setpoints))
        else:
            words = self.setpoints
        if control_word == self.control_word and words == self.setpoints:
            return True  # said again: the drive has taken every transition that this word asks for
        self.dirty.is_set = True
        acknowledge = bool(control_word & ~self.control_word & ACKNOWLEDGE)
        self.control_word, self.setpoints = control_word, words
        if acknowledge and self.state is NordState.FAULT and not self._cause_present:
            self.fault_tenths = 0
            self.state = NordState.SWITCH_ON_INHIBITED  # transition 15
        self._settle()
        return True

    def follow(self, demand: Demand | None) -> None:
        """Follow what the interface demands in the drive profile."""
        if demand != self.demand:
            self.demand = demand
            self.dirty.is_set = True

    def trip(self, fault_tenths: int, *, lasting: bool = False) -> None:
        """Transition 13. A ``lasting`` cause blocks the acknowledge until ``cause_gone``."""
        if self.state in (NordState.FAULT_REACTION, NordState.FAULT):
            return  # the first fault is the one to be seen
        self.fault_tenths, self._cause_present = fault_tenths, lasting
        self.last_faults.appendleft(fault_tenths)
        self._output_off(self._time)
        self.state, self._until = NordState.FAULT_REACTION, self._time + FAULT_REACTION_S
        self.dirty.is_set = True

    def communication_lost(self, fault_tenths: int) -> None:
        """Field bus or system bus is lost: a fault, unless P513 (or for 10.9 also P120) lets the drive go
        on."""
        if self.parameters.raw(513) == _IGNORE:
            return  # §8.1: ignores every communication error and keeps its state
        if fault_tenths == INTERFACE_MISSING and self.parameters.raw(120) == 0:
            return
        self.trip(fault_tenths, lasting=True)

    def cause_gone(self) -> None:
        self._cause_present = False

    def advance(self, now: float) -> None:
        """Let the time until ``now`` pass."""
        dt_s, self._time = max(0.0, now - self._time), now
        if self.state in _AT_REST:
            return
        before = self.state
        if self.state is NordState.NOT_READY and now >= self._until:
            self.state = NordState.SWITCH_ON_INHIBITED  # transition 1
        elif self.state is NordState.FAULT_REACTION and now >= self._until:
            self.state = NordState.FAULT  # transition 14
        elif self.state in (NordState.ENABLED, NordState.QUICK_STOP):
            self._ramp(dt_s)
        self._settle()
        if self.state is not before:
            self.dirty.is_set = True

    def next_deadline(self) -> float | None:
        if self.state in (NordState.NOT_READY, NordState.FAULT_REACTION):
            return self._until
        if self.state not in (NordState.ENABLED, NordState.QUICK_STOP):
            return None
        restless = (self._ripple > 0 and self.output_hz != 0) or self._is_under_way()
        return next_tick(self._time) if restless or self.output_hz != self._ramp_target_hz() else None

    # How it works inside.

    @property
    def _set(self) -> int:
        """Active parameter set, 1…4: bits 14 and 15. The drive profile has set 1 alone (§7.1.2, P168)."""
        return 1 if self.demand else (self.control_word >> 14) + 1

    @property
    def _aim(self) -> Aim:
        """Aim by the present parameters and words."""
        of = self.parameters.changes, self.control_word, self.setpoints, self.demand
        if of != self._aim_of:
            scales = Scales.of(self.parameters, self._set)
            self._aim_of, self._aim_then = of, Aim.of(scales, self.control_word, self.setpoints, self.demand)
        return self._aim_then

    def _goal(self) -> int | None:
        """Position that it goes to."""
        return self._aim.increments if self._runs else None

    def _goal_hz(self) -> float:
        """The frequency demanded by the present control word."""
        aim = self._aim
        return aim.hz if self._runs and aim.increments is None else 0.0

    @property
    def _runs(self) -> bool:
        return self.state is NordState.ENABLED and self.control_word & 0x7F == 0x7F

    def _ramp_target_hz(self) -> float:
        if self.state is NordState.ENABLED and self.control_word & 0x31 == 0x11:
            return self.output_hz  # bit 5 = 0 holds the frequency
        return self._goal_hz()

    def _setpoint_reached(self) -> bool:
        """§6.5.2: with POSICON the set position."""
        if self.state in (NordState.FAULT_REACTION, NordState.FAULT):
            return False
        goal = self._aim.increments
        if goal is not None:
            return self.output_hz == 0 and abs(goal - self.position_increments) < 1
        return self.output_hz == self._goal_hz()

    def _is_under_way(self) -> bool:
        """True on the way to a position, with a speed to go there."""
        goal = self._goal()
        return goal is not None and self.position_increments != goal and self._aim.most_hz > 0

    def _ramp(self, dt_s: float) -> None:
        goal = self._goal()
        if goal is not None:
            self._position(goal, dt_s)
            return
        before_hz, target_hz = self.output_hz, self._ramp_target_hz()
        if before_hz == target_hz and not self._accelerating and not self._ripple:
            self._turn(before_hz, dt_s)
            return
        self.dirty.is_set = True
        if self.state is NordState.ENABLED and self.control_word & 0x11 == 0x01:
            self.output_hz = 0.0  # bit 4 = 0 sets the ramp generator to 0; the voltage stays on
        else:
            up_s, down_s = self._ramp_times_s()
            self.output_hz = step(before_hz, target_hz, up_s, down_s, self._aim.scales.max_hz, dt_s)
        self._turn(before_hz, dt_s)
        self._accelerating = abs(self.output_hz) > abs(before_hz) and self.output_hz != target_hz
        self._ripple_now = self._random.uniform(-self._ripple, self._ripple) if self.output_hz else 0.0

    def _position(self, goal: int, dt_s: float) -> None:
        before = self.position_increments, self.output_hz
        times_s = self._ramp_times_s()
        up, down = (self._aim.scales.max_hz / max(time_s, 0.01) for time_s in times_s)
        after = approach(*before, goal, self._aim.most_hz, (up, down), dt_s)
        self.position_increments, self.output_hz = after
        self._accelerating = abs(self.output_hz) > abs(before[1])
        self.dirty.is_set |= after != before

    def _turn(self, before_hz: float, dt_s: float) -> None:
        """The shaft turns on."""
        before = self.position_increments
        self.position_increments = turned(before, before_hz, self.output_hz, dt_s)
        if self.position_increments != before and (self.has_encoder or self._aim.scales.shows_position):
            self.dirty.is_set = True

    def _ramp_times_s(self) -> tuple[float, float]:
        """Up and down, between 0 and P105."""
        up_s, down_s = (self.parameters.value(number, self._set) for number in (102, 103))
        if self.demand:
            up_s = up_s if self.demand.accelerate_s is None else self.demand.accelerate_s
            down_s = down_s if self.demand.decelerate_s is None else self.demand.decelerate_s
        if self.state is NordState.QUICK_STOP:
            down_s = self.parameters.value(426, self._set)
        return up_s, down_s

    def _settle(self) -> None:
        """Make all transitions that the control word asks for; this goes on without a new telegram."""
        while True:
            if self.state is NordState.QUICK_STOP and self.output_hz == 0:
                self._enter(NordState.SWITCH_ON_INHIBITED)  # §6.5.1 bit 2: ends there at 0 Hz
            transition = commanded(self.state, self.control_word)
            if transition is None or (transition.at_standstill and self.output_hz != 0):
                return
            self._enter(transition.target)

    def _enter(self, state: NordState) -> None:
        # Only from "enabled" to "quick stop" does the voltage stay on.
        if self.state in (NordState.ENABLED, NordState.QUICK_STOP) and state is not NordState.QUICK_STOP:
            self._output_off(self._time)
        self.state = state

    def _output_off(self, now: float) -> None:
        """Voltage off: the frequency shown is 0 at once, the shaft runs down."""
        self._coast_hz, self._coast_at = self.motor_hz(now), now
        self.output_hz, self._accelerating, self._ripple_now = 0.0, False, 0.0

    def actual_value(self, number: int) -> int:
        """One of them, from 1, by its P543 code: frequency, current, inputs, setpoint, fault number, position
        (low and high word, §5.4); others 0."""
        scales = self._aim.scales
        match scales.actual_values[number - 1]:
            case 1:
                return _word(self.output_hz / scales.max_hz)
            case 3 | 4:
                return _word(self.current_a / scales.rated_a)
            case 5:
                return self.digital_inputs & 0xFFFF
            case 8:
                return _word(self._aim.hz / scales.max_hz)
            case 9:
                return self.fault_tenths
            case 10:
                return self._position_word & 0xFFFF
            case 15:
                return self._position_word >> 16 & 0xFFFF
            case _:
                return 0

    @property
    def _position_word(self) -> int:
        return round(self.position_increments / self._aim.scales.stretch)

    def _shown(self, words: Sequence[int], element: int) -> int:
        return words[element - 1] if self.parameters.raw(509) else 0


def _word(share: float) -> int:
    """A share of the reference value as a word: 1.0 is 4000h, limited to ±200 %."""
    return max(-0x8000, min(0x7FFF, round(share * HUNDRED_PERCENT))) & 0xFFFF
