"""Unit ids and their register maps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final

from bridge.command import Drive, Plant, Source
from bridge.command.device import Device
from bridge.command.rights import rights_of
from bridge.northbound.modbus.device_registers import DeviceMap
from bridge.northbound.modbus.registers import Allows, DriveMap, Row, Table, row_maker

BRIDGE_DRIVES: Final = 5
"""First input register of the bridge's one word per drive."""
_MODULE_STATE: Final = (
    "bits as NORD P173: 0 pre-operational, 1 operational, 2 a node lost, 3 a watchdog tripped, "
    "4 CAN warning, 5 bus-off; here also 8…9 the worst that is wrong anywhere: 0 nothing, 1 warning, "
    "2 alarm, 3 danger, 10 a drive may run on when the bridge falls silent"
)


def drive_maps(plant: Plant) -> tuple[DriveMap, ...]:
    """The maps of all drives, by unit id, with the access that this site gives."""
    return tuple(DriveMap(drive, _allows(plant, drive)) for _, drive in sorted(plant.by_unit.items()))


def _allows(plant: Plant, one: Drive | Device) -> Allows:
    rights = rights_of(plant, Source.MODBUS)
    write = partial(rights.may_write, plant)
    return Allows(write, may_command=rights.may_command(one), may_stop=rights.may_stop(one))


def device_maps(plant: Plant) -> tuple[DeviceMap, ...]:
    """The maps of all nodes that are no drives, by unit id, with the access that this site gives."""
    points = {point.name: point for point in plant.image.points}
    devices = sorted(plant.devices.values(), key=lambda device: device.unit_id)
    return tuple(DeviceMap(device, points, _allows(plant, device)) for device in devices)


@dataclass(frozen=True, slots=True)
class Units:
    """Owners of unit ids: the drives, the nodes that are no drives, and the bridge itself with its buses and
    its nodes, but those that the site file leaves out of service. All are in the order of the site file."""

    site: str
    buses: tuple[str, ...]
    nodes: tuple[str, ...]
    drives: tuple[DriveMap, ...]
    devices: tuple[DeviceMap, ...]

    @property
    def bridge_rows(self) -> tuple[Row, ...]:
        """The map of the bridge's own unit."""
        row = row_maker(Table.INPUT_REGISTER, "r")
        return (
            row(0, "module_state", "uint16", "", _MODULE_STATE),
            row(1, "load", "uint16", "0.1 %", "bus load of the first bus"),
            row(2, "state", "uint16", "", "CAN controller: 0 ok, 1 warning, 2 passive, 3 bus-off, 4 down"),
            row(3, "drives_configured", "uint16", "", "drives in the site file"),
            row(4, "drives_good", "uint16", "", "drives with good data"),
            *(
                row(address, drive.drive_name, "uint16", "", f"unit {drive.unit_id}: quality + 256 × state")
                for address, drive in enumerate(self.drives, BRIDGE_DRIVES)
            ),
        )


def units_of(plant: Plant) -> Units:
    """The units of a site; what may be written is not looked at."""
    return Units(
        plant.site.site.name,
        tuple(bus.name for bus in plant.site.bus),
        tuple(node.name for node in plant.nodes.values() if node.table.enabled),
        tuple(map(DriveMap, plant.drives.values())),
        device_maps(plant),
    )
