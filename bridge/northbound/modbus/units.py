"""Unit ids and their register maps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final

from bridge.catalogue import Catalogue, MemberSpec, Source, rights_of
from bridge.northbound.modbus.device_registers import DeviceMap
from bridge.northbound.modbus.registers import Allows, DriveMap, RegisterTable, Row, row_maker

BRIDGE_DRIVES: Final = 5
"""First input register of the bridge's one word per drive."""
_MODULE_STATE: Final = (
    "bits as NORD P173: 0 pre-operational, 1 operational, 2 a node lost, 3 a watchdog tripped, "
    "4 CAN warning, 5 bus-off; here also 8…9 the worst that is wrong anywhere: 0 nothing, 1 warning, "
    "2 alarm, 3 danger, 10 a drive may run on when the bridge falls silent"
)


def drive_maps(catalogue: Catalogue) -> tuple[DriveMap, ...]:
    """The maps of all drives, by unit id, with the access that this site gives."""
    drives = sorted(catalogue.drives.values(), key=lambda drive: drive.unit_id)
    return tuple(DriveMap(drive, _allows(catalogue, drive)) for drive in drives)


def _allows(catalogue: Catalogue, one: MemberSpec) -> Allows:
    rights = rights_of(catalogue, Source.MODBUS)
    write = partial(rights.may_write, catalogue)
    return Allows(write, may_command=rights.may_command(one), may_stop=rights.may_stop(one))


def device_maps(catalogue: Catalogue) -> tuple[DeviceMap, ...]:
    """The maps of all nodes that are no drives, by unit id, with the access that this site gives."""
    devices = sorted(catalogue.devices.values(), key=lambda device: device.unit_id)
    return tuple(DeviceMap(device, _allows(catalogue, device)) for device in devices)


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
        row = row_maker(RegisterTable.INPUT_REGISTER, "r")
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


def units_of(catalogue: Catalogue) -> Units:
    """The units of a site; what may be written is not looked at."""
    return Units(
        catalogue.site.site.name,
        tuple(bus.name for bus in catalogue.site.bus),
        tuple(node.name for node in catalogue.nodes.values() if node.table.enabled),
        tuple(map(DriveMap, catalogue.drives.values())),
        device_maps(catalogue),
    )
