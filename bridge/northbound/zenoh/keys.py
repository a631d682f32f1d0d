"""The zenoh keys, and how values, events and outcomes are written under them. Sans-IO."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, nan
from typing import Any, Final

import msgspec

from bridge.command import Event, Outcome
from bridge.image import Columns, Point, Quality, Reading, Value
from bridge.northbound.zenoh.users import own_keys
from bridge.text import as_json, in_english

JSON: Final = "application/json"
TEXT: Final = "text/plain"

_encode = msgspec.json.Encoder().encode


class _Shown(msgspec.Struct, omit_defaults=True):
    """A reading. ``v`` is null if there is no value, ``t`` if there never was one."""

    v: Value | None
    q: str
    t: float | None
    s: str = ""
    r: str = ""


class _Beside(msgspec.Struct, omit_defaults=True):
    """The attachment of a bare value."""

    q: str
    t: float | None
    s: str = ""
    r: str = ""


class _Told(msgspec.Struct, omit_defaults=True):
    t: float
    kind: str
    source: str
    severity: int
    message: str
    cause: str = ""
    code: str = ""
    facts: dict[str, Any] | None = None


class _Done(msgspec.Struct, omit_defaults=True):
    ok: bool
    forwarded: bool
    message: str = ""
    v: Value | None = None


class _Rejection(msgspec.Struct, omit_defaults=True):
    ok: bool
    code: str
    message: str
    abort_code: str = ""


class KeySpace:
    """The keys of one site: ``<prefix>/<site>/<point name>``.

    Chunks that begin with ``@`` are not matched by ``*`` and ``**``: a client that asks for all values gets
    only values.
    """

    def __init__(self, prefix: str, site: str, points: Sequence[Point]) -> None:
        self.top = f"{prefix}/{site}"
        self.points = points
        self.keys: tuple[str, ...] = tuple(f"{self.top}/{point.name}" for point in points)
        self.index: dict[str, int] = {key: i for i, key in enumerate(self.keys)}
        self.everything = f"{self.top}/**"
        self.commands = f"{self.top}/*/*/command/**"
        self.controllers = f"{self.top}/@/controller/**"
        self.own_commands = f"{self.top}/@/controller/*/*/*/command/**"
        owners = [_owner(point.name) for point in points]
        self.owners = tuple(dict.fromkeys(owners))
        """Owners of points: each drive, node and bus, and the bridge."""
        self._places = {owner: place for place, owner in enumerate(self.owners)}
        self.owner_of: tuple[int, ...] = tuple(self._places[owner] for owner in owners)
        """The place of each point's in ``owners``."""
        self._of_owner: dict[str, list[int]] = {owner: [] for owner in self.owners}
        for index, owner in enumerate(owners):
            self._of_owner[owner].append(index)
        self.prompt = (*(f"{self.top}/{owner}/**" for owner in self.owners), self.controllers)
        """The keys of one drive, node, bus or the bridge: so few points that the answer fits into the queue
        to any client that reads at all."""
        self.bridge_token = f"{self.top}/@/bridge"
        self._states = tuple({code: in_english(text) for code, text in point.states} for point in points)

    def is_prompt(self, key: str) -> bool:
        """Whether one of ``prompt`` includes ``key``, which may have wildcards."""
        if not key.startswith(f"{self.top}/"):
            return False
        tail = self.tail(key)
        own = tail.removeprefix("@/controller")
        if "/@" in own:  # which ** does not include
            return False
        return _owner(tail) in self._places or (own != tail and own[:1] in ("", "/"))

    def of_owner(self, key: str) -> Sequence[int]:
        """The points of the drive, node or bus, or of the bridge, to which ``key`` belongs; none for keys of
        controllers, which are no values."""
        return self._of_owner.get(_owner(self.tail(key)), ())

    def share(self, key: str, payload: bytes | None) -> str:
        """Queue in which a query or put waits. zenoh does not tell who sent it, but each user has command
        keys of its own; and readers must not crowd out commands."""
        words = self.tail(key).split("/")
        if words[:2] == ["@", "controller"]:
            return "/".join(words[:3])
        return "commands" if payload is not None or "command" in words else "reads"

    def own_keys(self, name: str) -> str:
        return f"{self.top}/{own_keys(name)}"

    def node_token(self, node: str) -> str:
        return f"{self.top}/@/{node}"

    def event_key(self, event: Event) -> str:
        return f"{self.top}/@/event/{event.kind}"

    def tail(self, key: str) -> str:
        """``key`` without prefix and site."""
        return key[len(self.top) + 1 :]

    def as_json(self, index: int | None, reading: Reading, epoch_ns: int) -> bytes:
        """``{"v": …, "q": "good", "t": seconds since 1970}``; ``s`` is the name of an enumeration's value,
        ``r`` the reason for a quality that is not good. ``index`` is None for a parameter that was read."""
        return _encode(_Shown(_value(reading), *self._circumstances(index, reading, epoch_ns)))

    def as_jsons(self, indices: Sequence[int], columns: Columns, at_zero_ns: int) -> Iterator[bytes]:
        """The same for many points. ``at_zero_ns``: the wall clock at time 0 of the readings."""
        last, tail = nan, ""
        states, good = self._states, Quality.GOOD
        for index, value, quality, time, why in zip(indices, *columns, strict=True):
            if time != last:  # many change together
                last = time
                tail = f',"q":"good","t":{seconds(at_zero_ns + round(time * 1e9))!r}}}'
            # What most of them are is written here, four times as fast.
            is_plain = type(value) is int or (type(value) is float and isfinite(value))
            if is_plain and quality is good and not why and not states[index]:
                yield f'{{"v":{value!r}{tail}'.encode()
            else:
                reading = Reading(value, quality, time, why)
                yield self.as_json(index, reading, at_zero_ns + round(time * 1e9))

    def as_bare(self, index: int | None, reading: Reading, epoch_ns: int) -> tuple[bytes, bytes]:
        """The value as text, empty if there is none, and the attachment with everything else."""
        value = _value(reading)
        if value is None:
            text = b""
        elif isinstance(value, str):
            text = value.encode()
        else:
            text = _encode(value)
        return text, _encode(_Beside(*self._circumstances(index, reading, epoch_ns)))

    def _circumstances(
        self, index: int | None, reading: Reading, epoch_ns: int
    ) -> tuple[str, float | None, str, str]:
        quality = reading.quality
        time = None if quality is Quality.WAITING else seconds(epoch_ns)
        state = ""
        if index is not None and self._states[index] and quality.has_value and isinstance(reading.value, int):
            state = self._states[index].get(reading.value, "")
        return quality.label, time, state, in_english(reading.why)


def _owner(tail: str) -> str:
    """``<node>/<drive>``, ``<node>/node``, ``bus/<bus>`` or ``bridge``."""
    words = tail.split("/", 2)
    return words[0] if words[0] == "bridge" else "/".join(words[:2])


def seconds(epoch_ns: int) -> float:
    """Seconds since 1970 UTC with six decimals."""
    return round(epoch_ns / 1e9, 6)


def event_json(event: Event, epoch_ns: int) -> bytes:
    """The time, kind, source, severity and message, with the message's code and facts where it has them, and
    the cause where something else explains it."""
    told = _Told(seconds(epoch_ns), event.kind, event.source, event.severity, event.message, event.cause)
    if text := as_json(event.said):
        told.code, told.facts = text["code"], text["facts"]
    return _encode(told)


def outcome_json(outcome: Outcome) -> bytes:
    """``{"ok": true, "forwarded": true}``, or ``{"ok": false, "code": …, "message": …}``. After a parameter
    was written, ``v`` is what the drive holds; if the drive refused it, there is ``abort_code``."""
    if outcome.ok:
        return _encode(_Done(True, outcome.forwarded, outcome.message, outcome.value))
    return refusal_json(outcome.code, outcome.message, outcome.abort_code)


def refusal_json(code: str, message: str, abort_code: int = 0) -> bytes:
    return _encode(_Rejection(False, code, message, f"{abort_code:08X}" if abort_code else ""))


def _value(reading: Reading) -> Value | None:
    """A value that is not valid any more is left out, because some readers look at nothing else."""
    return reading.value if reading.quality.has_value else None
