"""One tab of the page: its requests, and the drives that it controls. Sans-IO.

A tab is a controller like any other. It commands under an identity of its own, so that two tabs of one person
are two controllers; it renews its leases itself, by messages that it sends while it is in the foreground; and
what it leaves behind is given back. Nothing here renews anything.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from typing import Annotated, Any, Final

import msgspec

from bridge.base.ratelimit import RateLimit
from bridge.command import Action, Code, Do, Identity, Outcome, Request, Role, Source
from bridge.command.messages.request import COMMANDS
from bridge.northbound.page.traffic import TrafficFilter
from bridge.northbound.view import View
from bridge.text import Text, as_json

MOST_BYTES: Final = 16_384
"""Largest message from a tab, bytes."""
_MESSAGES, _EVERY_S = 100, 0.02
"""Limit of messages from a tab: ``_MESSAGES`` at once, then one in ``_EVERY_S`` seconds."""
_MOST_TOPICS: Final = 16
MOST_FOLLOWED: Final = 12
_HIGHEST: Final = 2**53 - 1
"""Largest integer that JavaScript holds exactly."""
_FIELDS: Final[dict[Action, tuple[str, ...]]] = {
    Action.WRITE: ("values",),
    Action.START: ("direction",),
    Action.TAKE_CONTROL: ("ttl_ms",),
    Action.SET_TIMEOUT: ("timeout_ms",),
    Action.READ_PARAMETER: ("parameter", "max_age_ms"),
    Action.WRITE_PARAMETER: ("parameter", "value"),
}
"""Fields of a request by action; all other actions have none."""


class BadMessage(Exception):
    """The tab sent something that is no message of ours: the connection ends with this reason."""


class _Show(msgspec.Struct, forbid_unknown_fields=True):
    """Message with the topics that are shown from now on."""

    show: list[str]


class _Trend(msgspec.Struct, forbid_unknown_fields=True):
    """Message with the points whose trend is drawn from now on. ``number`` comes back with their rows."""

    trend: list[str]
    number: Annotated[int, msgspec.Meta(ge=0, le=_HIGHEST)] = 0


class _Ask(msgspec.Struct, forbid_unknown_fields=True):
    """Message with a request; its outcome comes back with the same number."""

    ask: int
    target: str
    action: str
    fields: dict[str, Any] = {}


class _Hear(msgspec.Struct, forbid_unknown_fields=True):
    """Filter for the traffic that is shown from now on; null shows none."""

    hear: TrafficFilter | None


class _Hidden(msgspec.Struct, forbid_unknown_fields=True):
    """Message of a tab that is not in the foreground any more: the drives it controls are given back."""

    hidden: bool


_decode_show = msgspec.json.Decoder(_Show).decode
_decode_trend = msgspec.json.Decoder(_Trend).decode
_decode_ask = msgspec.json.Decoder(_Ask).decode
_decode_hear = msgspec.json.Decoder(_Hear).decode
_decode_hidden = msgspec.json.Decoder(_Hidden).decode
_decode_any = msgspec.json.Decoder(dict[str, msgspec.Raw]).decode
_encode = msgspec.json.Encoder().encode


class Viewer:
    """One tab of ``user``. ``tell`` gets messages for it; ``topics`` is what it shows at present,
    ``followed`` are the points whose course it draws, by their places in the image."""

    def __init__(
        self, view: View, user: str, role: Role, address: str, tell: Callable[[bytes], None]
    ) -> None:
        self.identity = Identity(Source.LOCAL, f"{user or 'visitor'}#{secrets.token_hex(3)}", role, address)
        self.topics: tuple[str, ...] = ()
        self.followed: tuple[int, ...] = ()
        self.choice = 0
        """Number that the tab gave its present trend."""
        self.traffic: TrafficFilter | None = None
        """Filter for the traffic that it shows, None for none."""
        self._places = view.image.index
        self._view = view
        self._tell = tell
        self._owned: dict[str, None] = {}
        """Drives and outputs that it controls, as far as outcomes say, in the order of taking them."""
        self._left = 0
        """Number of times that it gave up everything it controls."""
        self._limit = RateLimit(_MESSAGES, _EVERY_S)

    @property
    def commands(self) -> bool:
        """True while it controls something."""
        return bool(self._owned)

    def on_message(self, data: bytes, now: float, known: Callable[[str], bool]) -> None:
        """One message of the tab; ``known`` says which topics there are, of buses ``bus <bus>``. Raises
        ``BadMessage``."""
        if len(data) > MOST_BYTES:
            raise BadMessage(f"a message has at most {MOST_BYTES} bytes")
        if not self._limit.allows(now):
            raise BadMessage("too many messages")
        try:
            keys = _decode_any(data)
            if "show" in keys:
                self._show(_decode_show(data).show, known)
            elif "trend" in keys:
                self._follow(_decode_trend(data))
            elif "ask" in keys:
                self._ask(_decode_ask(data))
            elif "hear" in keys:
                self._hear(_decode_hear(data).hear, known)
            elif _decode_hidden(data).hidden:
                self.leave()
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise BadMessage(f"no message of this page: {error}") from None

    def _show(self, topics: list[str], known: Callable[[str], bool]) -> None:
        unknown = next((topic for topic in topics if not known(topic)), None)
        if unknown is not None or len(topics) > _MOST_TOPICS:
            raise BadMessage(f"there is no topic {str(unknown)[:80]!r}")
        self.topics = tuple(dict.fromkeys(topics))

    def _follow(self, trend: _Trend) -> None:
        names = trend.trend
        unknown = next((name for name in names if name not in self._places), None)
        if unknown is not None or len(names) > MOST_FOLLOWED:
            raise BadMessage(f"there is no point {str(unknown)[:80]!r}, or it is one too many")
        self.followed = tuple(self._places[name] for name in names)
        self.choice = trend.number

    def _hear(self, wanted: TrafficFilter | None, known: Callable[[str], bool]) -> None:
        if wanted is not None and not known(f"bus {wanted.bus}"):
            raise BadMessage(f"there is no bus {wanted.bus[:80]!r}")
        self.traffic = wanted

    def _ask(self, ask: _Ask) -> None:
        left = self._left

        def answered(outcome: Outcome) -> None:
            self._on_outcome(ask, outcome, has_left=left != self._left)
            shown = {
                "outcome": ask.ask,
                "ok": outcome.ok,
                "code": str(outcome.code),
                "message": outcome.message,
                "text": as_json(outcome.said),
                "forwarded": outcome.forwarded,
                "value": outcome.value,
                "abort_code": outcome.abort_code,
            }
            self._tell(_encode(shown))

        try:
            action = Action(ask.action)
        except ValueError:
            unknown = Text.of("request.unknown", action=ask.action[:80])
            answered(Outcome(Code.UNKNOWN_POINT, unknown, forwarded=False))
            return
        fields = {name: value for name, value in ask.fields.items() if name in _FIELDS.get(action, ())}
        if len(fields) != len(ask.fields):
            answered(Outcome(Code.OUT_OF_RANGE, _takes(action), forwarded=False))
            return
        try:
            kind = COMMANDS.get(action)
            command = Do(action) if kind is None else msgspec.convert(fields, kind)
        except (msgspec.ValidationError, TypeError) as error:
            said = Text.of("request.malformed", action=Text.word("action", action), error=str(error))
            answered(Outcome(Code.OUT_OF_RANGE, said, forwarded=False))
            return
        self._view.submit(Request(self.identity, ask.target, command), answered)

    def _on_outcome(self, ask: _Ask, outcome: Outcome, *, has_left: bool) -> None:
        if not outcome.ok:
            return
        if ask.action == Action.TAKE_CONTROL:
            if has_left:
                self._give_back(ask.target)
            else:
                self._owned[ask.target] = None
        elif ask.action == Action.RELEASE_CONTROL:
            self._owned.pop(ask.target, None)

    def leave(self) -> None:
        """Give back the drives it controls: the tab is hidden, closed or cut off. Where the bus process does
        not answer, control ends with the lease."""
        self._left += 1
        owned, self._owned = self._owned, {}
        for target in owned:
            self._give_back(target)

    def _give_back(self, target: str) -> None:
        self._view.submit(Request(self.identity, target, Do(Action.RELEASE_CONTROL)), lambda outcome: None)


def _takes(action: Action) -> Text:
    fields = ", ".join(_FIELDS.get(action, ()))
    named = Text.word("action", action)
    if not fields:
        return Text.of("request.no_fields", action=named)
    return Text.of("request.fields", action=named, fields=fields)
