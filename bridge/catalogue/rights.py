"""Rights of the clients of one protocol to write on a site: for those who program against it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.catalogue.codes import Source
from bridge.catalogue.site import Catalogue
from bridge.catalogue.specs import MemberSpec
from bridge.image.point import Point, WriteKind

_TAKES_LEASES: Final = (Source.OPCUA, Source.ZENOH)
_ENGINEERS: Final = ("engineer", "admin")


@dataclass(frozen=True, slots=True)
class Rights:
    """``has_engineers``: some client may be one. ``sets_parameters``: others may set parameters, too."""

    source: Source
    has_engineers: bool = False
    sets_parameters: bool = False

    def may_write(self, catalogue: Catalogue, point: Point) -> bool:
        """True where a write of this point is ever carried out."""
        owner, _, _ = point.name.rpartition("/")
        name = owner.rpartition("/")[0]
        one = catalogue.members.get(name)
        if not point.writable or one is None:
            return point.writable
        if point.write is WriteKind.PARAMETER:
            return self._may_set(one, point.name.removeprefix(f"{name}/parameter/"))
        return self.may_command(one)

    def may_command(self, one: MemberSpec) -> bool:
        """True where clients may command a drive, or the outputs of a node that is none."""
        return one.control == self.source.label or (one.control == "lease" and self.source in _TAKES_LEASES)

    def may_stop(self, one: MemberSpec) -> bool:
        return one.stop_by_anyone or self.may_command(one)

    def _may_set(self, one: MemberSpec, leaf: str) -> bool:
        entry = next((entry for entry in one.names.points() if entry.leaf == leaf), None)
        if entry is None or one.sdo_channel is None:
            return False
        if not one.names.protection.may_set(entry.address, is_engineer=self.has_engineers):
            return False
        return self.has_engineers or (
            self.sets_parameters and (self.may_command(one) or not one.is_commanded)
        )


def rights_of(catalogue: Catalogue, source: Source) -> Rights:
    """Rights of a protocol of the site; of one that is not served, those that its defaults would give."""
    site = catalogue.site
    if source is Source.OPCUA:
        users = site.opcua.user if site.opcua else []
        return Rights(source, has_engineers=any(user.role in _ENGINEERS for user in users))
    table = site.modbus if source is Source.MODBUS else site.zenoh
    return Rights(source, sets_parameters=table is None or table.parameters == "write")
