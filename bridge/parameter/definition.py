"""One value of a drive, and where it stands in the object dictionary."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bridge.mapping.model import ObjectRef, Parameter
from bridge.mapping.parameters import leaf_of


@dataclass(frozen=True, slots=True)
class ParameterEntry:
    """One value of a drive: a parameter, one element of it, or an object that no file describes."""

    name: str
    address: ObjectRef
    definition: Parameter | None = None

    @property
    def as_bytes(self) -> ParameterEntry:
        """The same object with its bytes for a value; whatever protects it stays."""
        if self.definition is None:
            bare = Parameter.model_validate({"name": self.name, "title": "", "data_type": "bytes"})
            return replace(self, definition=bare)
        plain: dict[str, object] = {
            "data_type": "bytes",
            "factor": 1.0,
            "low": None,
            "high": None,
            "states": {},
            "german_states": {},
            "unit": "",
        }
        return replace(self, definition=self.definition.model_copy(update=plain))

    @property
    def leaf(self) -> str:
        """Name as a point, such as ``p102_2_3`` for P102[2].3."""
        return leaf_of(self.name)

    @property
    def unit(self) -> str:
        return self.definition.unit if self.definition else ""
