"""The drive's own values of the parameters that scale its words."""

from __future__ import annotations

from collections.abc import Generator

from bridge.command import Drive
from bridge.command.plant import Node
from bridge.image import DataType
from bridge.mapping.model import Parameter
from bridge.southbound.boot.actions import Action, BootResult, optional
from bridge.southbound.canopen.sdo import SdoError
from bridge.southbound.sdo_channels import FIRST, channel_of


def read_scales(
    node: Node, drive: Drive, result: BootResult
) -> Generator[Action, bytes | None, dict[str, float]]:
    """By parameter name, where they can be read: over the SDO channel that reaches this drive."""
    scales: dict[str, float] = {}
    channel = channel_of(node, drive.slot)
    if channel is None:
        return scales
    for parameter in drive.family.parameter:
        if not parameter.read:
            continue
        try:
            data = yield from optional(parameter.object.index, parameter.object.sub, channel)
        except SdoError:
            if channel == FIRST:
                raise
            # The drive behind the channel may be away while the node itself is there.
            result.notes.append(f"{drive.slot.name}: SDO channel {channel} does not answer")
            return scales
        value = 0.0 if data is None else parameter_value(parameter, data)
        if value <= 0:
            continue
        scales[parameter.name] = value
        given = drive.given_parameters.get(parameter.name)
        if given is not None and abs(given - value) > 1e-6:
            result.notes.append(
                f"{drive.slot.name}: {parameter.name} is {value:g} {parameter.unit} in the drive, "
                f"{given:g} in the site file; the drive's counts"
            )
    return scales


def number_from(data_type: DataType, data: bytes) -> int:
    """The number in ``data``, little-endian, signed where its type is. Bytes beyond the type's are left
    out: some servers answer every read with four."""
    size = 4 if data_type.value.endswith("32") else 2 if data_type.value.endswith("16") else 1
    return int.from_bytes(data[:size], "little", signed=data_type in (DataType.INT16, DataType.INT32))


def parameter_value(parameter: Parameter, data: bytes) -> float:
    """The value of a parameter from its bytes, in its unit."""
    return round(number_from(parameter.data_type, data) * parameter.factor, 9)
