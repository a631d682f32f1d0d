"""Objects of a drive family, put into canopen's object dictionary."""

# canopen declares no types for what its dictionaries hold.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import math
from typing import Final

from canopen import ObjectDictionary
from canopen.objectdictionary import ODRecord, ODVariable

from bridge.dictionary.object_dictionary import one_line
from bridge.eds import StaticDataType
from bridge.mapping.model import Family, ObjectRef, Poll
from bridge.parameter import ParameterEntry
from bridge.parameter.names import Names

_TYPES: Final = {
    "bool": StaticDataType.BOOLEAN,
    "string": StaticDataType.VISIBLE_STRING,
    "bytes": StaticDataType.OCTET_STRING,
    "real32": StaticDataType.REAL32,
    "real64": StaticDataType.REAL64,
    **{f"int{bits}": StaticDataType[f"INTEGER{bits}"] for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": StaticDataType[f"UNSIGNED{bits}"] for bits in (8, 16, 32, 64)},
}
_REALS: Final = (StaticDataType.REAL32, StaticDataType.REAL64)


def add_family(dictionary: ObjectDictionary, family: Family) -> None:
    """Name the family's parameters and polled objects in ``dictionary``, with unit, factor, limits and texts;
    objects that it does not have are added.

    A parameter is found by the vendor's name and by that of its point: ``P102.1`` and ``p102_1``. Where
    parameter sets or elements make several objects of it, its plain name is that of the whole record.
    """
    information = dictionary.device_information
    information.vendor_name = information.vendor_name or one_line(family.family.vendor)
    information.product_name = information.product_name or one_line(family.family.name)
    for poll in family.poll:
        _add_poll(dictionary, poll)
    taken: set[ObjectRef] = set()
    for entry in Names(family).entries():
        if entry.address not in taken:
            taken.add(entry.address)
            _add_parameter(dictionary, entry)


def _add_poll(dictionary: ObjectDictionary, poll: Poll) -> None:
    variable = _place(dictionary, poll.object, poll.name, poll.name)
    variable.data_type = _TYPES[poll.data_type]
    if not variable.access_type:
        variable.access_type = "ro"
    variable.description = one_line(str(poll.description))
    variable.bit_definitions = {name: [bit] for bit, name in enumerate(poll.bits) if name}


def _add_parameter(dictionary: ObjectDictionary, entry: ParameterEntry) -> None:
    definition = entry.definition
    if definition is None:
        return
    variable = _place(dictionary, entry.address, entry.name, definition.name)
    dictionary.names.setdefault(entry.leaf, variable)
    variable.data_type = _TYPES[definition.data_type]
    variable.access_type = definition.access
    variable.unit = one_line(definition.unit)
    texts = ", ".join(f"{code} = {text}" for code, text in definition.states.items())
    title = one_line(definition.title)
    variable.description = f"{title}: {one_line(texts)}" if texts else title
    if definition.data_type in ("string", "bytes"):
        return
    if variable.data_type in _REALS:
        # canopen has neither a factor nor limits for them, and a unit without the factor would be wrong.
        variable.unit = variable.unit if definition.factor == 1.0 else ""
        return
    factor = variable.factor = definition.factor
    variable.value_descriptions = {round(code / factor): text for code, text in definition.states.items()}
    if definition.low is not None:
        variable.min = math.ceil(round(definition.low / factor, 6))
    if definition.high is not None:
        variable.max = math.floor(round(definition.high / factor, 6))


def _place(dictionary: ObjectDictionary, address: ObjectRef, name: str, group_name: str) -> ODVariable:
    """The variable at ``address``, called ``name`` from now on, made where there is none."""
    found = dictionary.indices.get(address.index)
    if found is None and address.sub == 0:
        variable = ODVariable(name, address.index)
        variable.access_type = ""
        dictionary.add_object(variable)
        return variable
    if isinstance(found, ODVariable) and address.sub == 0:
        found.name = name
        dictionary.names[name] = found
        return found
    if found is None or isinstance(found, ODVariable):
        group = ODRecord(group_name, address.index)
        if found is not None:
            group.add_member(found)
        dictionary.add_object(group)
        found = group
    variable = found.subindices.get(address.sub)
    if variable is None:
        variable = ODVariable("", address.index, address.sub)
        variable.access_type = ""
    variable.name = name
    found.add_member(variable)
    found.name = group_name
    # The record first: a plain name is the whole of it.
    dictionary.names[group_name] = found
    dictionary.names.setdefault(name, variable)
    return variable
