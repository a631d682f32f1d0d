"""What one unit id answers: the interface, and the bridge's own unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Protocol

from bridge.command import Drive, Identity, Node, Plant, Request
from bridge.command.link import NodeState
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, Refused
from bridge.northbound.modbus.registers import BRIDGE_DRIVES, Table

_BUS_WARNING, _BUS_PASSIVE, _BUS_OFF, _BUS_DOWN = 1, 2, 3, 4


class Unit(Protocol):
    """One unit id. Every method raises ``Refused`` and then has changed nothing.

    The ``plan`` methods make the requests that a write stands for, in the order in which they are to be
    submitted; all but the first can only fail if the first one does.
    """

    def read_bits(self, table: Table, start: int, count: int, now: float) -> Sequence[bool]: ...

    def read_words(
        self, table: Table, start: int, count: int, caller: Identity, now: float
    ) -> Sequence[int]: ...

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]: ...

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]: ...

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]: ...

    def identify(self) -> Mapping[int, str]:
        """Texts for device identification by object id, in rising order."""
        ...


def refuse_quality(quality: Quality) -> None:
    """Raise ``Refused`` where a value of this quality is not served."""
    if not quality.has_value:
        configured = quality is not Quality.CONFIG_ERROR
        raise Refused(ExceptionCode.NOT_RESPONDING if configured else ExceptionCode.PATH_UNAVAILABLE)


def state_code(drive: Drive, quality: Quality) -> int:
    """The state as served; what a drive was doing when it was last heard of is not its state."""
    if quality.has_value or drive.channel.is_tripped:
        return drive.channel.served_state
    return DriveState.UNKNOWN


class BridgeUnit:
    """The bridge itself: input registers only, any other table is an illegal function."""

    __slots__ = ("_buses", "_nodes", "_plant", "_version")

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._buses: Final = tuple(bus.name for bus in plant.site.bus)
        self._nodes: Final = tuple(plant.nodes.values())

    def read_words(self, table: Table, start: int, count: int, caller: Identity, now: float) -> Sequence[int]:
        if table is not Table.INPUT_REGISTER:
            raise Refused(ExceptionCode.ILLEGAL_FUNCTION)
        drives = self._plant.drives.values()
        if start + count > BRIDGE_DRIVES + len(drives):
            raise Refused(ExceptionCode.ILLEGAL_ADDRESS)
        qualities = [drive.channel.link.quality(now) for drive in drives]
        bus_state = self._bus_state()
        words = [
            self._module_state(bus_state),
            self._load(),
            bus_state,
            len(qualities),
            sum(quality is Quality.GOOD for quality in qualities),
            *(
                quality | state_code(drive, quality) << 8
                for drive, quality in zip(drives, qualities, strict=True)
            ),
        ]
        return words[start : start + count]

    def _bus_state(self) -> int:
        """The worst controller state of all buses; a bus that was not opened yet is down."""
        readings = [self._plant.image.read(f"bus/{name}/state") for name in self._buses]
        return max(int(reading.value) if reading.quality.has_value else _BUS_DOWN for reading in readings)

    def _load(self) -> int:
        """Load of the first bus in 0.1 %."""
        reading = self._plant.image.read(f"bus/{self._buses[0]}/load")
        return min(max(round(float(reading.value) * 10), 0), 0xFFFF)

    def _module_state(self, bus_state: int) -> int:
        """The bits of P173 (BU 2500 §7.1.3). Bits 8 … 15 are about drives and have a register each here."""
        states = [_node_state(node) for node in self._nodes if node.table.enabled]
        operational = all(state is NodeState.OPERATIONAL for state in states)
        starting = any(
            state in (NodeState.ABSENT, NodeState.BOOTING, NodeState.CONFIG_ERROR) for state in states
        )
        lost = NodeState.LOST in states
        tripped = any(drive.channel.is_tripped for drive in self._plant.drives.values())
        warning = bus_state in (_BUS_WARNING, _BUS_PASSIVE)
        bits = (starting, operational, lost, tripped, warning, bus_state == _BUS_OFF)
        return sum(bit << position for position, bit in enumerate(bits))

    def read_bits(self, table: Table, start: int, count: int, now: float) -> Sequence[bool]:
        raise Refused(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]:
        raise Refused(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        raise Refused(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]:
        raise Refused(ExceptionCode.ILLEGAL_FUNCTION)

    def identify(self) -> Mapping[int, str]:
        version = str(self._plant.image.read("bridge/version").value)
        return {
            0: "drivebridge",
            1: "drivebridge",
            2: version,
            4: "drivebridge",
            6: self._plant.site.site.name,
        }


def _node_state(node: Node) -> NodeState:
    """All drives of a node are told the same."""
    return node.drives[0].channel.link.node
