"""Writes of clients to the drives' own supervision of the bridge: which of them are refused, and after which
it is no longer known. Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.command import Drive, ParameterHolder
from bridge.command.node import Node
from bridge.image import Value
from bridge.mapping.own_places import OwnPlace, ends_own_watch, places
from bridge.parameter import ParameterEntry, ParameterError
from bridge.parameter.codec import encode_value
from bridge.text import Said, Text


class OwnWatch:
    """Guard over the own supervision of one node's drives."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._protection = node.names.protection
        self._places = {drive.name: places(drive.family) for drive in node.drives}

    def why_kept(self, drive: ParameterHolder, entry: ParameterEntry, value: Value) -> Said:
        """Reason to refuse a write: a drive of the site is stopped by silence, and would no longer stop.
        Empty for none."""
        key = entry.address.index, entry.address.sub
        silent: list[str] = []
        for one in self._owners(drive, entry) or self._node.drives:
            place = next((place for place in self._places[one.name] if place.key == key), None)
            raw = None if place is None else _raw(place, entry, value)
            if one.table.falls_silent and raw is not None and ends_own_watch(one.family, key, raw):
                silent.append(one.name)
        if not silent:
            return ""
        return Text.of("own.would_end", parameter=entry.name, drives=tuple(silent))

    def forget(
        self, drive: ParameterHolder, entry: ParameterEntry, now: float, *, is_certain: bool = True
    ) -> None:
        """Forget what the boot-up has read of the own supervision, because this was written or, without
        ``is_certain``, may have been; the next boot-up reads it again."""
        if not self._protection.tells_own_supervision(entry.address):
            return
        why = Text.of("own.changed" if is_certain else "own.may_have_changed", parameter=entry.name)
        for one in self._owners(drive, entry) or self._node.commanded:
            one.on_own_supervision_changed(why, now)

    def _owners(self, drive: ParameterHolder, entry: ParameterEntry) -> Sequence[Drive]:
        """Drives that have the object for themselves: ``drive``, or another axis; none where it is the
        node's."""
        having = [one for one in self._node.drives if self._is_own(one, entry)]
        return [one for one in having if one is drive] or having

    def _is_own(self, drive: Drive, entry: ParameterEntry) -> bool:
        index = entry.address.index
        return any(one.per_drive and one.ref.index == index for one in self._places[drive.name])


def _raw(place: OwnPlace, entry: ParameterEntry, value: Value) -> int | None:
    """Raw value that the object would hold; None for a value that it does not take."""
    try:
        return place.number.decode(encode_value(entry, value, None))
    except ParameterError:
        return None
