"""What a mapping file of a device that is no drive says together."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import twice
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family

_OF_DRIVES: Final = (
    "process",
    "control_word",
    "status_word",
    "meaning",
    "value",
    "own_supervision",
    "stopping",
)
_NEEDED: Final = ("process", "control_word", "status_word")


def check_kind(family: Family, file: MergedFile) -> None:
    """A file is of drives, which have slots, or of a device, which has inputs."""
    if family.slot:
        for key in _NEEDED:
            if key not in file.data:
                file.fault(
                    (key,), "is missing", "a family of drives has it; a device without [[slot]] has not"
                )
        if family.input:
            file.fault(
                ("input",), "has no effect beside [[slot]]", "what drives tell are values of their words"
            )
        return
    for key in _OF_DRIVES:
        if key in file.data:
            file.fault((key,), "has no effect without a [[slot]]", "it is of drives")


def check_signals(family: Family, file: MergedFile) -> None:
    twice(((one.name, ("input", n, "name")) for n, one in enumerate(family.input)), "input", file)
    objects = ((f"{one.object}", ("input", n, "object")) for n, one in enumerate(family.input))
    twice(objects, "object of an input,", file)
    for n, one in enumerate(family.input):
        if one.factor == 0:
            file.fault(("input", n, "factor"), "must not be 0")
        if one.low is not None and one.high is not None and one.low > one.high:
            file.fault(("input", n, "low"), f"is above high, {one.high:g}")
        if one.is_scaled and (one.states or one.bits):
            file.fault(("input", n), "states and bits are of numbers without factor and offset")
        if len(one.bits) > one.size:
            file.fault(("input", n, "bits"), f"a {one.data_type} has {one.size} bits")
        twice(((name, ("input", n, "bits", b)) for b, name in enumerate(one.bits) if name), "bit", file)
