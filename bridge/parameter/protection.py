"""What may not be written as a parameter, under whatever name: judged by the objects that a write touches.

A maker's parameter may be another name of a communication object, or determine one in another form: see
``[aliases]`` of the mapping file.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.mapping.aliases import COMMUNICATION, Alias, aliases
from bridge.mapping.model import Family, ObjectRef, Parameter
from bridge.mapping.own_places import places
from bridge.mapping.parameters import indices
from bridge.parameter.definition import Entry

NEVER: Final = "command"
"""Nobody writes it as a parameter."""


class Protection:
    """``flagged`` has the definitions that are protected, with the index of their object."""

    def __init__(self, family: Family, flagged: Iterable[tuple[int, Parameter]]) -> None:
        rule = family.parameter_names
        self._commands = [indices(one) for one in rule.protected] if rule else []
        self._own = {place.ref.index for place in places(family, link=True)}
        self._flags: dict[int, str] = {index: one.protected for index, one in flagged if one.protected}
        self._aliases: dict[int, list[Alias]] = {}
        for alias in aliases(family):
            self._aliases.setdefault(alias.ref.index, []).append(alias)
        self._process = {
            part
            for slot in family.slot
            for pdo in slot.rpdo
            for objects in pdo.objects
            for mapped in objects
            for part in mapped.parts
        }

    def stands_for(self, address: ObjectRef) -> tuple[ObjectRef, ...]:
        """The communication objects that an object is another name of, or decides; what stands beside one
        under the same index is taken to be one, too."""
        beside = self._aliases.get(address.index, [])
        exact = [alias for alias in beside if alias.ref.sub == address.sub]
        return tuple(dict.fromkeys(ref for alias in exact or beside for ref in alias.objects))

    def level(self, address: ObjectRef) -> str:
        """Who may write an object and when (``Parameter.protected``); what stands beside a protected
        parameter under the same index is protected like it, and so is what the drive watches the
        bridge by."""
        if self._commands_drive(address.index) or self._aliases.get(address.index):
            return NEVER
        if address.index in COMMUNICATION or address in self._process:
            return NEVER
        return self._flags.get(address.index) or ("communication" if address.index in self._own else "")

    def _commands_drive(self, index: int) -> bool:
        return self._flags.get(index) == NEVER or any(index in span for span in self._commands)

    def tells_own_supervision(self, address: ObjectRef) -> bool:
        """Whether an object says what the drive does when the bridge falls silent."""
        return any(one.index in self._own for one in (address, *self.stands_for(address)))

    def why_never(self, entry: Entry) -> str:
        """Why nobody writes it as a parameter; empty where somebody may."""
        address = entry.address
        if self._commands_drive(address.index):
            return f"{entry.name} commands the drive: its controller alone does, by process data"
        objects = self.stands_for(address)
        where = "belongs to the communication that the bridge supervises: set it in the site file"
        if objects:
            names = ", ".join(str(ref) for ref in objects)
            return f"{entry.name} ({address}) stands for {names}, which {where} ([[bus.node.configure]])"
        if address.index in COMMUNICATION:
            return f"{entry.name} {where} ([[bus.node.configure]])"
        if address in self._process:
            return f"{entry.name} is process data, which the drive's controller alone commands"
        return ""

    def why_forced(self, entry: Entry) -> str:
        """Why the command line, which knows no roles, writes it with ``--force`` only, if at all."""
        why = self.why_never(entry)
        if not why and self.level(entry.address) == "communication":
            why = f"{entry.name} decides who commands the drive and what supervises it"
        return why
