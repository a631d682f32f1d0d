"""Parameters that scale a drive's words, and those that say what the words carry, as read from the drive."""

from __future__ import annotations

import math
from collections.abc import Generator

from bridge.canopen.datatypes import INTEGERS, NUMBERS
from bridge.canopen.dialogue import optional
from bridge.canopen.sdo import SdoError
from bridge.command import Drive
from bridge.command.node import Node
from bridge.drive import Codes, deciding, is_scale, no_scale
from bridge.mapping.model import Family, Meaning, ObjectRef, Parameter
from bridge.node.boot.actions import Action, BootResult, WordFacts, go_on_without
from bridge.node.places.sdo_channels import FIRST
from bridge.text import Text, render


class NotANumber(ValueError):
    """The bytes of a parameter are no number."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said

    def __str__(self) -> str:
        return render(self.said)


def meanings_of(drive: Drive) -> list[tuple[Meaning, int, ObjectRef]]:
    """Objects to be read for what a drive's words carry: the word's meaning, the parameter set, the
    object."""
    family = drive.family
    groups = ("command", "actual")
    asked = [one for group in groups for run in family.meanings_of(drive.slot, group) for one in run]
    sets = range(1, family.sets + 1)
    return [(one, in_set, family.object_of_meaning(one, in_set)) for in_set in sets for one in asked]


def deciding_of(drive: Drive, codes: Codes) -> list[tuple[Parameter, int, ObjectRef]]:
    """Parameters to be read for a drive whose words have these codes, because they scale a value or decide
    whether there is one; each with its parameter set and object."""
    family = drive.family
    return [
        (one, in_set, family.object_in_set(family.object_of(one), in_set))
        for one in deciding(family, drive.slot, codes)
        for in_set in range(1, family.sets + 1 if one.sets else 2)
    ]


def code_of(family: Family, meaning: Meaning, data: bytes | None) -> int | None:
    """Code in an answer; ``absent`` of the meaning where the drive has refused one, None where the answer is
    no code."""
    if data is None:
        return meaning.absent
    parameter, _ = family.parameter_and_set(meaning.parameter)
    kind = next((one.data_type for one in family.parameter if one.name == parameter), "int16")
    try:
        return INTEGERS.get(kind, INTEGERS["int16"]).decode(data)
    except ValueError:
        return None


def read_words(node: Node, drive: Drive, result: BootResult) -> Generator[Action, bytes | None, WordFacts]:
    """Read what a drive's words mean, over the SDO channel that reaches it."""
    found = WordFacts()
    channel = drive.spec.sdo_channel
    asked = meanings_of(drive)
    found.codes = {one.leaf: [None] * drive.family.sets for one, _, _ in asked}
    if channel is None:
        found.why_unread = Text.of("meaning.no_channel")
        return found
    try:
        for one, in_set, ref in asked:
            try:
                data = yield from optional(ref.index, ref.sub, channel)
            except SdoError as error:
                _go_on_without(error, channel, result)
            else:
                found.codes[one.leaf][in_set - 1] = code_of(drive.family, one, data)
                if data is not None:
                    found.told.add((one.leaf, in_set))
        yield from _read_parameters(node, drive, channel, found, result)
    except SdoError:
        if channel == FIRST:
            raise
        # The drive behind the channel may be away while the node itself is there.
        result.notes.append(Text.of("boot.channel_silent", slot=drive.slot.name, channel=channel))
        found.why_unread = Text.of("meaning.channel_silent", channel=channel)
    return found


def _go_on_without(error: SdoError, channel: int, result: BootResult) -> None:
    """Go on without the meaning of a word. Raises ``error`` where nobody is behind the channel."""
    if channel != FIRST and not error.was_answered:
        raise error
    go_on_without(error, result)


def _read_parameters(
    node: Node, drive: Drive, channel: int, found: WordFacts, result: BootResult
) -> Generator[Action, bytes | None]:
    scaling = {name for value in drive.family.value for name in value.scaled_by}
    for parameter, in_set, ref in deciding_of(drive, found.codes):
        try:
            data = yield from optional(ref.index, ref.sub, channel)
            value = None if data is None else parameter_value(parameter, data)
        except SdoError as error:
            _go_on_without(error, channel, result)
            value = math.nan
        except NotANumber as error:
            result.notes.append(Text.of("boot.of_slot", slot=drive.slot.name, what=error.said))
            value = math.nan
        found.parameters[parameter.name, in_set] = value
        if value is not None and not math.isnan(value):
            found.told.add((parameter.name, in_set))
        if value is None or parameter.name not in scaling or not parameter.read:
            continue
        if not is_scale(value):
            what = no_scale(parameter.name, value)
            result.notes.append(Text.of("boot.of_slot", slot=drive.slot.name, what=what))
        elif in_set == 1:
            _compare(drive, parameter, value, result)


def _compare(drive: Drive, parameter: Parameter, value: float, result: BootResult) -> None:
    """Note a value of set 1 that differs from the site file's."""
    given = drive.given_parameters.get(parameter.name)
    if given is not None and abs(given - value) > 1e-6:
        note = Text.of(
            "boot.scale_of_drive",
            slot=drive.slot.name,
            parameter=parameter.name,
            value=value,
            unit=parameter.unit,
            given=given,
        )
        result.notes.append(note)


def parameter_value(parameter: Parameter, data: bytes) -> float:
    """Value of a parameter in its unit, from its bytes. Raises NotANumber where it is none."""
    number = NUMBERS.get(parameter.data_type)
    if number is None:
        said = Text.of("boot.parameter_no_number", parameter=parameter.name, type=parameter.data_type)
        raise NotANumber(said)
    try:
        return round(number.decode(data) * parameter.factor, 9)
    except ValueError:
        name, kind = parameter.name, parameter.data_type
        said = Text.of("boot.parameter_bytes", parameter=name, type=kind, count=len(data))
        raise NotANumber(said) from None
