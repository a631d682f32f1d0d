"""Checks of a mapping file of a device that is no drive."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import twice
from bridge.mapping.device_signals import Signal
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family

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
                file.fault(
                    (key,), "is missing", "a family of drives has it; a device without [[slot]] has not"
                )
        if family.family.read_only:
            file.fault(
                ("family", "read_only"), "is of a device without drives", 'control = "none" of the site'
            )
        for key in ("input", "output"):
            if key in file.data:
                file.fault(
                    (key,), "has no effect beside [[slot]]", "what drives take and tell is in [[value]]"
                )
        return
    if family.family.read_only and family.output:
        file.fault(("family", "read_only"), "is of a device without outputs", "leave out [[output]]")
    for key in _OF_DRIVES:
        if key in file.data:
            file.fault((key,), "has no effect without a [[slot]]", "it is of drives")


def check_signals(family: Family, file: MergedFile) -> None:
    for kind, signals in (("input", family.input), ("output", family.output)):
        twice(((one.name, (kind, n, "name")) for n, one in enumerate(signals)), kind, file)
        objects = ((f"{one.object}", (kind, n, "object")) for n, one in enumerate(signals))
        twice(objects, f"object of an {kind},", file)
        for n, one in enumerate(signals):
            _check_signal(one, (kind, n), file)
    for n, one in enumerate(family.output):
        try:
            if one.factor and one.on_expiry != "hold":
                one.encode(one.on_expiry)
        except ValueError as error:
            file.fault(("output", n, "on_expiry"), str(error))


def _check_signal(one: Signal, key: tuple[str, int], file: MergedFile) -> None:
    if one.factor == 0:
        file.fault((*key, "factor"), "must not be 0")
    if one.low is not None and one.high is not None and one.low > one.high:
        file.fault((*key, "low"), f"is above high, {one.high:g}")
    if one.is_scaled and (one.states or one.bits):
        file.fault(key, "states and bits are of numbers without factor and offset")
    if len(one.bits) > one.size:
        file.fault((*key, "bits"), f"a {one.data_type} has {one.size} bits")
    twice(((name, (*key, "bits", b)) for b, name in enumerate(one.bits) if name), "bit", file)
