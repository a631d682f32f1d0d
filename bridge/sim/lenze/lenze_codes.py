"""The codes of an 8400 motec as objects: index = 5FFFh − code, sub-index = sub-code (EDS84DMOTCAN 3.0,
§9.2, §12).

C00002, C00007, C00011…C00013, C00039, C00061, C00088, C00099, C00105 and C00168 belong to the drive.
This manual names most of them and gives data types only in its examples (§9.2, §9.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from bridge.sim.core.communication_settings import DISABLED, CommunicationSettings
from bridge.sim.core.dictionary import Dictionary, IntegerType, VisibleString, item, variable
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_code_table import CodeTable
from bridge.sim.lenze.lenze_drive import LenzeDrive, Reaction
from bridge.sim.lenze.lenze_objects import LenzeObjects
from bridge.sim.lenze.lenze_settings import LenzeCodes

FIRMWARE: Final = "01.00.00.00"
"""C00099, as the example of §9.3.3 reads it."""
BIT_RATES: Final = (0, 1, 2, 3, 4, 5, 14)
MCI_REACTIONS: Final = (Reaction.NONE, Reaction.FAULT, Reaction.WARNING_LOCKED)
"""C01501 (§12.1)."""
_NMT_STATES: Final = {
    SlaveState.OPERATIONAL: 0,
    SlaveState.PRE_OPERATIONAL: 1,
    SlaveState.INITIALISING: 4,
    SlaveState.STOPPED: 5,
}
"""C00359."""
_NO_ERROR: Final = 1
"""C00364, bit 0: a simulated frame is never damaged."""

U8, U16, U32 = IntegerType.UNSIGNED8, IntegerType.UNSIGNED16, IntegerType.UNSIGNED32
I32 = IntegerType.INTEGER32


@dataclass(slots=True)
class BusDisplay:
    """C00345, C00360/1…12 and C00372/1…2."""

    error_state: int = 0
    counters: list[int] = field(default_factory=lambda: [0] * 12)
    tx_errors: int = 0
    rx_errors: int = 0

    def reset(self) -> None:
        self.error_state = self.tx_errors = self.rx_errors = 0
        self.counters[:] = [0] * len(self.counters)

    def count(self, *sub_codes: int) -> None:
        for sub_code in sub_codes:
            self.counters[sub_code - 1] = self.counters[sub_code - 1] + 1 & 0xFFFF


@dataclass(frozen=True, slots=True)
class CodeParts:
    """Parts of the drive that the codes display and change."""

    codes: Store[LenzeCodes]
    stack: Store[CommunicationSettings]
    objects: LenzeObjects
    drive: LenzeDrive
    display: BusDisplay
    nmt_state: Callable[[], SlaveState]
    watched_status: Callable[[], int]
    save: Callable[[], None]
    reset_node: Callable[[], None]


def add_codes(dictionary: Dictionary, parts: CodeParts) -> None:
    """Put every code into ``dictionary``."""
    table = CodeTable(dictionary, parts.codes)
    _add_device_commands(table, parts)
    _add_pdo_codes(table, parts)
    _add_communication_codes(table, parts)
    _add_supervision_codes(table, parts)
    _add_displays(table, parts)
    _add_drive_codes(table, parts)


def _add_device_commands(table: CodeTable, parts: CodeParts) -> None:
    """C00002/11 saves all parameters, /26 is CAN Reset Node: 1 starts it (§6.4, §7.2.3)."""

    def command(action: Callable[[], None]) -> Callable[[int], None]:
        return lambda value: action() if value else None

    table.add(2, 11, U8, lambda: 0, command(parts.save), (0, 1))
    table.add(2, 26, U8, lambda: 0, command(parts.reset_node), (0, 1))


def _add_pdo_codes(table: CodeTable, parts: CodeParts) -> None:
    codes, objects, stack = parts.codes, parts.objects, parts.stack

    def set_inhibit(place: int, value: int) -> None:
        if place:
            objects.set_inhibit_ms(place - 1, value)
        else:
            objects.set_emcy_inhibit_ms(value)

    def set_cob_id(place: int, value: int) -> None:
        # Counts after a reset of the node (§12.2); bit 31 alone is that of 1400h:1.
        codes.current.cob_ids[place] = value & 0x7FF
        objects.set_pdo_off(place, value >> 31)

    def cob_id(place: int) -> int:
        off = DISABLED if codes.current.pdo_off[place] else 0
        return codes.current.cob_ids[place] | off

    def active_cob_id(place: int) -> int:
        pdos = stack.current.tpdo if place % 2 else stack.current.rpdo
        return pdos[place // 2].cob_id

    def set_tx_type(place: int, value: int) -> None:
        objects.set_transmission_type(2 * place + 1, value)

    def set_rx_type(place: int, value: int) -> None:
        objects.set_transmission_type(2 * place, value)

    table.array(322, U8, lambda: codes.current.tx_types, (0, 255), set_tx_type)
    table.array(323, U8, lambda: codes.current.rx_types, (0, 255), set_rx_type)
    table.array(324, U16, lambda: codes.current.inhibit_ms, (0, 6500), set_inhibit)
    table.array(353, U8, lambda: codes.current.cob_source, (0, 2))
    table.count(354, len(codes.current.cob_ids))
    for place in range(len(codes.current.cob_ids)):
        table.add(354, place + 1, U32, partial(cob_id, place), partial(set_cob_id, place))
    table.displays(355, U16, len(codes.current.cob_ids), active_cob_id)
    table.array(389, U8, lambda: codes.current.pdo_off, (0, 1), objects.set_pdo_off)
    table.array(409, U16, lambda: codes.current.mapping, (0, 0xFFFF))


def _add_communication_codes(table: CodeTable, parts: CodeParts) -> None:
    codes, objects = parts.codes, parts.objects

    def set_time(place: int, value: int) -> None:
        match place:
            case 1:
                objects.set_cycle_ms(1, value)
            case 4:
                objects.set_cycle_ms(0, value)
            case _:
                codes.current.times_ms[place] = value

    def both_channels() -> int:
        return int(not any(cob_id & DISABLED for cob_id in codes.current.sdo_cob_ids))

    table.add(350, 0, U8, lambda: codes.current.node_id, lambda value: codes.current.move_to(value), (1, 63))
    table.choice(351, 0, variable(U8, lambda: codes.current, "bit_rate"), BIT_RATES)
    table.setting(352, 0, U8, "master", (0, 1))
    table.array(356, U16, lambda: codes.current.times_ms, (0, 65000), set_time)
    table.add(366, 0, U8, both_channels, objects.use_both_sdo_channels, (0, 1))
    table.add(367, 0, U16, lambda: codes.current.sync_rx, objects.set_sync_rx, (128, 255))
    table.setting(368, 0, U16, "sync_tx", (128, 255))
    table.setting(369, 0, U16, "sync_ms", (0, 65000))


def _add_supervision_codes(table: CodeTable, parts: CodeParts) -> None:
    codes = parts.codes
    reactions = tuple(Reaction)
    table.array(357, U16, lambda: codes.current.rpdo_time_ms, (0, 65000))
    table.add(381, 0, U16, lambda: codes.current.heartbeat_ms, parts.objects.set_heartbeat_ms, (0, 65535))
    table.count(385, 1)
    table.setting(385, 1, U8, "watched_node", (0, 127))
    table.count(386, 1)
    table.setting(386, 1, U16, "watched_ms", (0, 60000))
    table.array(1503, U16, lambda: codes.current.mci_time_ms, (0, 1000))
    for number, values, choices in (
        (592, lambda: codes.current.bus_reactions, reactions),
        (593, lambda: codes.current.rpdo_reactions, reactions),
        (1501, lambda: codes.current.mci_reactions, MCI_REACTIONS),
    ):
        table.count(number, len(values()))
        for place in range(len(values())):
            table.choice(number, place + 1, item(U8, values, place), choices)


def _add_displays(table: CodeTable, parts: CodeParts) -> None:
    display = parts.display
    table.add(345, 0, U8, lambda: display.error_state)
    table.count(347, 1)
    table.add(347, 1, U8, parts.watched_status)
    table.add(349, 0, U16, lambda: 0)  # all DIP switches off: the codes count
    table.add(359, 0, U8, lambda: _NMT_STATES[parts.nmt_state()])
    table.displays(360, U16, len(display.counters), lambda place: display.counters[place])
    table.add(364, 0, U8, lambda: _NO_ERROR)
    table.displays(372, U8, 2, lambda place: (display.tx_errors, display.rx_errors)[place])


def _add_drive_codes(table: CodeTable, parts: CodeParts) -> None:
    codes, drive = parts.codes, parts.drive
    table.setting(7, 0, U16, "control_mode", (10, 40))
    table.setting(11, 0, U16, "reference_rpm", (50, 60_000))
    for place, number in enumerate((12, 13, 105)):
        table.put(number, 0, item(U32, lambda: codes.current.ramp_ms, place, 0, 999_999))
    table.array(39, I32, lambda: codes.current.fixed_setpoints, (-19_999, 19_999))
    table.add(61, 0, I32, lambda: drive.temperature_c)
    # Called U16 and U32 in the same example, and written with four bytes there (§9.3.2).
    table.setting(88, 0, U32, "motor_current_ca", (0, 60_000))
    table.put(99, 0, VisibleString(FIRMWARE))
    table.add(168, 0, U32, lambda: drive.error_number)
