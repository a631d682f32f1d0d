"""A device description as canopen's object dictionary."""

from __future__ import annotations

from typing import Final

from canopen import ObjectDictionary
from canopen.objectdictionary import ODArray, ODRecord, ODVariable

from bridge.eds import Description, Entry, StaticDataType, Value
from bridge.eds.model import Object, ObjectType

_REALS: Final = (StaticDataType.REAL32, StaticDataType.REAL64)


def dictionary_of(description: Description, node_id: int | None = None) -> ObjectDictionary:
    """Every object of ``description``. Defaults and limits that depend on the node id are those of
    ``node_id``, or of the file where it names one; without either they are left out.

    An entry whose data type is not known holds bytes.
    """
    if node_id is None:
        node_id = description.commissioning.node_id
    dictionary = ObjectDictionary()
    dictionary.node_id = node_id
    dictionary.bitrate = description.commissioning.bitrate
    info, information = description.device_info, dictionary.device_information
    information.vendor_name = one_line(info.vendor)
    information.vendor_number = info.vendor_id
    information.product_name = one_line(info.product)
    information.product_number = info.product_code
    information.revision_number = info.revision
    information.order_code = one_line(info.order_code)
    information.allowed_baudrates = set(info.bitrates)
    for one in description.objects:
        _add(dictionary, one, node_id)
    return dictionary


def one_line(text: str) -> str:
    """An EDS has a line for each value."""
    return " ".join(text.split())


def _add(dictionary: ObjectDictionary, one: Object, node_id: int | None) -> None:
    name = one_line(one.name) or f"{one.index:04X}"
    if not one.object_type.has_subs and [entry.sub for entry in one.entries] == [0]:
        variable = _variable(one.entries[0], node_id)
        variable.name = name
        dictionary.add_object(variable)
        return
    group = (ODArray if one.object_type is ObjectType.ARRAY else ODRecord)(name, one.index)
    for entry in one.entries:
        group.add_member(_variable(entry, node_id))
    dictionary.add_object(group)


def _variable(entry: Entry, node_id: int | None) -> ODVariable:
    name = one_line(entry.name) or f"{entry.index:04X}:{entry.sub:02X}"
    variable = ODVariable(name, entry.index, entry.sub)
    variable.data_type = entry.data_type or StaticDataType.DOMAIN
    variable.access_type = entry.access.value
    variable.pdo_mappable = entry.pdo_mappable
    variable.relative = entry.default is not None and entry.default.plus_node_id
    # canopen knows limits of whole numbers only.
    if entry.data_type not in _REALS:
        variable.min = _number(entry.low, node_id)
        variable.max = _number(entry.high, node_id)
    variable.default = _plain(entry.default, node_id)
    variable.value = _plain(entry.parameter_value, node_id)
    # What canopen's own reader keeps of the text, and what its writer looks for first.
    if entry.default is not None:
        vars(variable)["default_raw"] = _written(entry.default)
    if entry.parameter_value is not None:
        vars(variable)["value_raw"] = _written(entry.parameter_value)
    return variable


def _plain(value: Value | None, node_id: int | None) -> int | None:
    """canopen declares all of them as numbers, and takes what the data type says."""
    return None if value is None else value.at(node_id)  # pyright: ignore[reportReturnType]


def _number(value: Value | None, node_id: int | None) -> int | None:
    plain = None if value is None else value.at(node_id)
    return plain if isinstance(plain, int) else None


def _written(value: Value) -> str:
    return value.plain.hex() if isinstance(value.plain, bytes) else one_line(str(value))
