"""What the clients of one protocol may write on this site: for those who program against it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.command.device import Device
from bridge.command.drive import Drive
from bridge.command.messages.request import Source
from bridge.command.plant import Plant
from bridge.image import Point

_TAKES_LEASES: Final = (Source.OPCUA, Source.ZENOH)


@dataclass(frozen=True, slots=True)
class Rights:
    """``has_engineers``: some client may be one. ``sets_parameters``: others may set parameters, too."""

    source: Source
    has_engineers: bool = False
    sets_parameters: bool = False

    def may_write(self, plant: Plant, point: Point) -> bool:
        """Whether a write of this point is ever carried out."""
        owner, _, _ = point.name.rpartition("/")
        name, _, group = owner.rpartition("/")
        one = plant.drives.get(name) or plant.devices.get(name)
        if not point.writable or one is None:
            return point.writable
        if group == "parameter":
            return self._may_set(plant, one, point.name.removeprefix(f"{name}/parameter/"))
        return self.may_command(one)

    def may_command(self, one: Drive | Device) -> bool:
        """Whether clients may command a drive, or the outputs of a node that is none."""
        control = one.table.control if isinstance(one, Drive) else one.control
        return control == self.source.label or (control == "lease" and self.source in _TAKES_LEASES)

    def may_stop(self, one: Drive | Device) -> bool:
        by_anyone = one.table.stop_by_anyone if isinstance(one, Drive) else one.stop_by_anyone
        return by_anyone or self.may_command(one)

    def _may_set(self, plant: Plant, one: Drive | Device, leaf: str) -> bool:
        node = plant.nodes[one.node_name if isinstance(one, Drive) else one.name]
        names = node.names_of(one)
        entry = next((entry for entry in names.points() if entry.leaf == leaf), None)
        if entry is None:
            return False
        if isinstance(one, Drive) and one.family.sdo_channel(one.slot, node.table.sdo_channels) is None:
            return False
        if not names.protection.may_set(entry.address, is_engineer=self.has_engineers):
            return False
        if self.has_engineers:
            return True
        may_command = self.may_command(one) if isinstance(one, Drive) or one.outputs else True
        return self.sets_parameters and may_command


def rights_of(plant: Plant, source: Source) -> Rights:
    """Those of a protocol of the site; where it is not served, as with the settings that it would have."""
    site = plant.site
    if source is Source.OPCUA:
        users = site.opcua.user if site.opcua else []
        return Rights(source, has_engineers=any(user.role == "engineer" for user in users))
    table = site.modbus if source is Source.MODBUS else site.zenoh
    return Rights(source, sets_parameters=table is None or table.parameters == "write")
