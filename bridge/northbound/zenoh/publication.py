"""Changed values, sent to those who subscribe to them."""

from __future__ import annotations

from functools import partial
from itertools import repeat
from typing import Final

from bridge.catalogue.codes import NODE_CODES, NodeState
from bridge.config import ZenohTable
from bridge.image import Quality
from bridge.northbound.view import View
from bridge.northbound.zenoh import keys
from bridge.zenohlink import Pace, Value, ZenohLink

_BRIDGE: Final = "bridge/version"
"""Good as long as the bus process is there."""
_NODE_STATE: Final = "/node/state"
_OPERATIONAL: Final = NODE_CODES[NodeState.OPERATIONAL]
_MOST_AT_ONCE: Final = 500


class Publication:
    """Follows the image for one session of zenoh.

    What belongs to a drive, a node or a bus is rendered and sent only while somebody subscribes to some of
    it; whoever is the first to do so gets what has changed meanwhile. The bridge has a token while the
    process that knows its points can be reached, a node while it is operational.
    """

    def __init__(self, view: View, space: keys.KeySpace, settings: ZenohTable, link: ZenohLink) -> None:
        self._view = view
        self._image = view.image
        self._keys = space
        self._is_json = settings.encoding == "json"
        self._link = link
        # Not at once: a storage must have been asked in a command's place, if it is, before it has the value
        # that the command brings. That value would be newer than our answer, and be taken for it.
        self._pace = Pace(self._tick, settings.period_ms / 1000, waits=True)
        self._feed = self._image.feed(self._pace.wake)
        self._has_readers = [False] * len(space.owners)
        self._held: list[dict[int, None]] = [{} for _ in space.owners]
        """Changes of each owner since nobody reads it."""
        self._bridge = self._image.index[_BRIDGE]
        self._tokens = {
            index: space.node_token(name.removesuffix(_NODE_STATE))
            for name, index in self._image.index.items()
            if name.endswith(_NODE_STATE) and not name.startswith("bus/")
        } | {self._bridge: space.bridge_token}
        self._held_tokens: set[str] = set()

    def start(self) -> None:
        for place, owner in enumerate(self._keys.owners):
            self._link.follow_readers(f"{self._keys.top}/{owner}/**", partial(self._on_readers, place))
        self._pace.wake()
        self._pace.start()

    def stop(self) -> None:
        """May be called again, also before ``start``."""
        self._pace.stop()
        self._view.hurry(is_wanted=False)
        self._image.drop_feed(self._feed)

    def _on_readers(self, place: int, are_there: bool) -> None:
        self._has_readers[place] = are_there
        self._view.hurry(is_wanted=any(self._has_readers))
        if are_there and self._held[place]:
            self._feed.mark_all(self._held[place])
            self._held[place] = {}

    def _tick(self) -> None:
        # Newer values replace those that wait, so a zenoh that is slow has no backlog.
        if not self._link.is_publishing:
            self._publish(self._feed.take(_MOST_AT_ONCE))
        if self._feed:
            self._pace.wake()

    def _publish(self, changed: list[int]) -> None:
        owner_of, tokens, has_readers = self._keys.owner_of, self._tokens, self._has_readers
        read = list[int]()
        for index in changed:
            place = owner_of[index]
            if has_readers[place]:
                read.append(index)
            else:
                self._held[place][index] = None
            if index in tokens:
                self._follow_token(tokens[index], index)
        if read and not self._link.publish(self._values(read)):
            self._feed.mark_all(dict.fromkeys(read))

    def _values(self, indices: list[int]) -> list[Value]:
        names = [self._keys.keys[index] for index in indices]
        at_zero_ns = self._view.epoch_ns(0.0)
        if self._is_json:
            shown = self._keys.as_jsons(indices, self._image.columns(indices), at_zero_ns)
            return list(zip(names, shown, repeat(None), strict=False))
        readings = [self._image[index] for index in indices]
        return [
            (name, *self._keys.as_bare(index, reading, at_zero_ns + round(reading.time * 1e9)))
            for name, index, reading in zip(names, indices, readings, strict=True)
        ]

    def _follow_token(self, token: str, index: int) -> None:
        state = self._image[index]
        is_due = state.quality is Quality.GOOD and (index == self._bridge or state.value == _OPERATIONAL)
        if is_due and token not in self._held_tokens:
            self._held_tokens.add(token)
            self._link.declare_token(token)
        elif not is_due and token in self._held_tokens:
            self._held_tokens.discard(token)
            self._link.drop_token(token)
