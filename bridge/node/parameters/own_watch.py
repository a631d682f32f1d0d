"""What clients may not do to the drives' own supervision of the bridge, and what is no longer known of it
once they have written it. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.command import Drive, HasParameters
from bridge.command.plant import Node
from bridge.image import Value
from bridge.mapping.own_places import OwnPlace, ends_own_watch, places
from bridge.parameter import Entry, Names, ParameterError
from bridge.parameter.codec import encode_value


class OwnWatch:
    """Of the drives of one node."""

    def __init__(self, node: Node, names: Names) -> None:
        self._node = node
        self._protection = names.protection
        self._places = places(node.family)

    def why_kept(self, drive: HasParameters, entry: Entry, value: Value) -> str:
        """Why this is not written: a drive of the site is stopped by silence, and would not stop."""
        key = entry.address.index, entry.address.sub
        place = next((one for one in self._places if one.key == key), None)
        silent = [one.name for one in self._concerned(drive, entry) if one.table.falls_silent]
        if place is None or not silent:
            return ""
        raw = _raw(place, entry, value)
        if raw is None or not ends_own_watch(self._node.family, key, raw):
            return ""
        return (
            f"{entry.name} would end the watch by which silence stops {' and '.join(silent)}: first another "
            "on_expiry and no then_silence_ms in the site file"
        )

    def forget(self, drive: HasParameters, entry: Entry, what: str, now: float) -> None:
        """What the boot-up has read of it is not true any more; the next boot-up reads it again."""
        if not self._protection.tells_own_supervision(entry.address):
            return
        why = f"{entry.name} {what} since boot: boot the node to have it read again"
        for one in self._concerned(drive, entry):
            one.on_own_supervision_changed(why, now)
        device = self._node.device
        if device is not None and device.outputs is not None:
            device.outputs.on_own_supervision_changed(why, now)

    def _concerned(self, drive: HasParameters, entry: Entry) -> Sequence[Drive]:
        """Whom the object is about: ``drive``, or all of the node."""
        is_of_drive = any(one.per_drive and one.ref.index == entry.address.index for one in self._places)
        return [one for one in self._node.drives if not is_of_drive or one is drive]


def _raw(place: OwnPlace, entry: Entry, value: Value) -> int | None:
    """What the object would hold; None for a value that it does not take."""
    try:
        return place.number.decode(encode_value(entry, value, None))
    except ParameterError:
        return None
