"""One value of a drive, and where it stands in the object dictionary."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.mapping.model import ObjectRef, Parameter
from bridge.mapping.parameters import leaf_of


@dataclass(frozen=True, slots=True)
class Entry:
    """One value of a drive: a parameter, one element of it, or an object that no file describes."""

    name: str
    address: ObjectRef
    definition: Parameter | None = None

    @property
    def leaf(self) -> str:
        """Its name as a point, such as ``p102_2_3`` for P102[2].3."""
        return leaf_of(self.name)

    @property
    def unit(self) -> str:
        return self.definition.unit if self.definition else ""
