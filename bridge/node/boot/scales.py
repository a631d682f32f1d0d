"""The drive's own values of the parameters that scale its words."""

from __future__ import annotations

import math
from collections.abc import Generator

from bridge.canopen.datatypes import NUMBERS
from bridge.canopen.dialogue import optional
from bridge.canopen.sdo import SdoError
from bridge.command import Drive
from bridge.command.plant import Node
from bridge.mapping.model import Parameter
from bridge.node.boot.actions import Action, BootResult
from bridge.node.sdo_channels import FIRST, channel_of


def read_scales(
    node: Node, drive: Drive, result: BootResult
) -> Generator[Action, bytes | None, dict[str, float]]:
    """By parameter name, where they can be read: over the SDO channel that reaches this drive."""
    scales: dict[str, float] = {}
    channel = channel_of(node, drive.slot)
    if channel is None:
        return scales
    scaling = {value.full for value in drive.family.values_of(drive.slot)}
    for parameter in drive.family.parameter:
        if not parameter.read or parameter.name not in scaling:
            continue
        try:
            ref = node.family.object_of(parameter)
            data = yield from optional(ref.index, ref.sub, channel)
        except SdoError:
            if channel == FIRST:
                raise
            # The drive behind the channel may be away while the node itself is there.
            result.notes.append(f"{drive.slot.name}: SDO channel {channel} does not answer")
            return scales
        try:
            value = 0.0 if data is None else parameter_value(parameter, data)
        except ValueError as error:
            result.notes.append(f"{drive.slot.name}: {error}")
            continue
        if not 0 < value < math.inf:
            continue
        scales[parameter.name] = value
        given = drive.given_parameters.get(parameter.name)
        if given is not None and abs(given - value) > 1e-6:
            result.notes.append(
                f"{drive.slot.name}: {parameter.name} is {value:g} {parameter.unit} in the drive, "
                f"{given:g} in the site file; the drive's counts"
            )
    return scales


def parameter_value(parameter: Parameter, data: bytes) -> float:
    """The value of a parameter from its bytes, in its unit. Raises ValueError where it is no number."""
    number = NUMBERS.get(parameter.data_type)
    if number is None:
        raise ValueError(f"{parameter.name} is a {parameter.data_type}, no number")
    try:
        return round(number.decode(data) * parameter.factor, 9)
    except ValueError as error:
        raise ValueError(f"{parameter.name} is a {parameter.data_type}: {error}") from None
