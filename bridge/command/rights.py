"""What the clients of one protocol may write on this site: for those who program against it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.command.drive import Drive
from bridge.command.plant import Plant
from bridge.command.request import Source
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
        drive = plant.drives.get(name)
        if not point.writable or drive is None:
            return point.writable
        if group == "parameter":
            return self._may_set(plant, drive, point.name.removeprefix(f"{name}/parameter/"))
        return self.may_command(drive)

    def may_command(self, drive: Drive) -> bool:
        control = drive.table.control
        return control == self.source.label or (control == "lease" and self.source in _TAKES_LEASES)

    def may_stop(self, drive: Drive) -> bool:
        return drive.table.stop_by_anyone or self.may_command(drive)

    def _may_set(self, plant: Plant, drive: Drive, leaf: str) -> bool:
        node = plant.nodes[drive.node_name]
        names = node.names
        entry = next((entry for entry in names.points() if entry.leaf == leaf), None)
        if entry is None or drive.family.sdo_channel(drive.slot, node.table.sdo_channels) is None:
            return False
        if names.protection.why_never(entry):
            return False
        if self.has_engineers:
            return True
        is_open = names.protection.level(entry.address) != "communication"
        return is_open and self.sets_parameters and self.may_command(drive)


def rights_of(plant: Plant, source: Source) -> Rights:
    """Those of a protocol of the site; where it is not served, as with the settings that it would have."""
    site = plant.site
    if source is Source.OPCUA:
        users = site.opcua.user if site.opcua else []
        return Rights(source, has_engineers=any(user.role == "engineer" for user in users))
    table = site.modbus if source is Source.MODBUS else site.zenoh
    return Rights(source, sets_parameters=table is None or table.parameters == "write")
