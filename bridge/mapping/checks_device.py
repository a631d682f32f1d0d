"""Checks of a mapping file of a device that is no drive."""

from __future__ import annotations

from typing import Final

from bridge.image.limits import ValueNotTaken
from bridge.mapping.checks_process import twice
from bridge.mapping.device_signals import Signal
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family
from bridge.text import Text

_OF_DRIVES: Final = (
    "process",
    "control_word",
    "status_word",
    "meaning",
    "value",
    "stopping",
)
_NEEDED: Final = ("process", "control_word", "status_word")


def check_kind(family: Family, file: MergedFile) -> None:
    """Check that the file describes drives, which have slots, or a device, which has inputs."""
    if family.slot:
        for key in _NEEDED:
            if key not in file.data:
                file.fault((key,), Text.of("toml.missing"), Text.of("mapping.of_drives_missing_advice"))
        if family.family.read_only:
            said = Text.of("mapping.of_no_drives")
            file.fault(("family", "read_only"), said, Text.of("mapping.of_no_drives_advice"))
        for key in ("input", "output"):
            if key in file.data:
                said = Text.of("mapping.no_effect_beside", other="[[slot]]")
                file.fault((key,), said, Text.of("mapping.signals_of_drives_advice"))
        return
    if family.family.read_only and family.output:
        said = Text.of("mapping.of_no_outputs")
        file.fault(("family", "read_only"), said, Text.of("mapping.of_no_outputs_advice"))
    for key in _OF_DRIVES:
        if key in file.data:
            file.fault((key,), Text.of("mapping.needs_slot"), Text.of("mapping.needs_slot_advice"))


def check_signals(family: Family, file: MergedFile) -> None:
    for kind, signals, noun, of_object in (
        ("input", family.input, Text.of("mapping.noun_input"), Text.of("mapping.noun_input_object")),
        ("output", family.output, Text.of("mapping.noun_output"), Text.of("mapping.noun_output_object")),
    ):
        twice(((one.name, (kind, n, "name")) for n, one in enumerate(signals)), noun, file)
        twice(((f"{one.object}", (kind, n, "object")) for n, one in enumerate(signals)), of_object, file)
        for n, one in enumerate(signals):
            _check_signal(one, (kind, n), file)
    for n, one in enumerate(family.output):
        try:
            if one.factor and one.on_expiry != "hold":
                one.encode(one.on_expiry)
        except ValueNotTaken as error:
            file.fault(("output", n, "on_expiry"), error.said)


def _check_signal(one: Signal, key: tuple[str, int], file: MergedFile) -> None:
    if one.factor == 0:
        file.fault((*key, "factor"), Text.of("mapping.zero"))
    if one.low is not None and one.high is not None and one.low > one.high:
        file.fault((*key, "low"), Text.of("mapping.above_high", high=one.high))
    if one.is_scaled and (one.states or one.bits):
        file.fault(key, Text.of("mapping.states_unscaled"))
    if len(one.bits) > one.size:
        file.fault((*key, "bits"), Text.of("mapping.type_bits", type=one.data_type, bits=one.size))
    names = ((name, (*key, "bits", b)) for b, name in enumerate(one.bits) if name)
    twice(names, Text.of("mapping.noun_bit"), file)
