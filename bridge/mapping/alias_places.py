"""Places of the parameters that are other names of communication objects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bridge.mapping.entry_types import ObjectRef
from bridge.mapping.model import Family
from bridge.mapping.parameters import object_of
from bridge.text import Text
from bridge.tomlfile import Unfit


@dataclass(frozen=True, slots=True)
class Alias:
    """Parameter that stands for other objects. ``name`` is that in the mapping file, with "…" for one of its
    further elements; ``ref`` is its place in the object dictionary."""

    name: str
    ref: ObjectRef
    objects: tuple[ObjectRef, ...]
    is_same: bool


def aliases(family: Family) -> Iterator[Alias]:
    """Parameters, and elements of parameters, that stand for other objects.

    Raises ``Unfit`` for a name that is no parameter of the family; the mapping's checks find that first.
    """
    for is_same, table in ((True, family.aliases.same), (False, family.aliases.related)):
        for name, targets in table.items():
            first = place_of(family, name)
            for n, objects in enumerate(targets):
                ref = ObjectRef(first.index, first.sub + n)
                yield Alias(name if not n else f"{name} …", ref, tuple(objects), is_same)


def place_of(family: Family, name: str) -> ObjectRef:
    """Object of the parameter that an alias names. Raises ``Unfit`` where there is none."""
    for parameter in family.parameter:
        if parameter.name == name and parameter.object is not None:
            return parameter.object
    if family.parameter_names is None:
        raise Unfit(Text.of("mapping.no_parameter_names"))
    return object_of(family.parameter_names, name)
