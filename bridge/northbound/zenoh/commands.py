"""A query with a payload as a request to the plant. Sans-IO."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, TypeVar
from urllib.parse import unquote

import msgspec

from bridge.command import (
    Action,
    Code,
    Identity,
    ReadParameter,
    Request,
    SetTimeout,
    Source,
    Write,
    WriteParameter,
    command_of,
)
from bridge.command.messages.request import NMT_ACTIONS, NODE_ACTIONS
from bridge.image import Point, Value
from bridge.northbound.zenoh.users import ANONYMOUS, NAME, WANTED_NAME
from bridge.text import Text, render

METHODS: Final = (
    Action.START,
    Action.STOP,
    Action.QUICK_STOP,
    Action.DISABLE_VOLTAGE,
    Action.RESET_FAULT,
    Action.TAKE_CONTROL,
    Action.RELEASE_CONTROL,
    Action.KEEP_ALIVE,
    Action.SAVE_PARAMETERS,
)
OUTPUT_METHODS: Final = (
    Action.STOP,
    Action.RESET_FAULT,
    Action.TAKE_CONTROL,
    Action.RELEASE_CONTROL,
    Action.KEEP_ALIVE,
)
"""Methods of the outputs of a node that is no drive."""
_WITHOUT_PAYLOAD: Final = (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE, Action.RELEASE_CONTROL)
"""These need no payload. Everything else does, so that reading a key with a plain get cannot start or
acknowledge anything."""
NODE_METHODS: Final = tuple(action for action in Action if action in NODE_ACTIONS)
BUS_METHODS: Final = tuple(action for action in NODE_METHODS if action in NMT_ACTIONS)

MALFORMED: Final = "malformed"

_LONGEST: Final = 4096
_PARAMETER: Final = "/parameter/"
_CACHED_MS: Final = 2**31
"""Any age: whatever was read last."""
_LONGEST_MS: Final = 2**32 - 1
"""Range of OPC UA's UInt32 argument."""
_HEXADECIMAL: Final = re.compile(r"0[xX][0-9A-Fa-f]{1,8}")


class BadCommand(Exception):
    """The query is not a valid command. ``code`` is that of an outcome, or ``malformed``."""

    def __init__(self, code: str, said: Text) -> None:
        super().__init__(said)
        self.code = code
        self.said = said

    @property
    def message(self) -> str:
        """In English."""
        return render(self.said)


class _One(msgspec.Struct, forbid_unknown_fields=True):
    v: Value


class _CommandOptions(msgspec.Struct, forbid_unknown_fields=True):
    ttl_ms: int | msgspec.UnsetType = msgspec.UNSET
    direction: int | msgspec.UnsetType = msgspec.UNSET


class _Controller(msgspec.Struct):
    controller: str = ANONYMOUS
    session: str = ""


_one_or_bare = msgspec.json.Decoder(_One | bool | int | float | str)
_telegram = msgspec.json.Decoder(dict[str, Value])
_options = msgspec.json.Decoder(_CommandOptions)
_controller = msgspec.json.Decoder(_Controller)

_Model = TypeVar("_Model")


def identity_of(attachment: bytes | None) -> Identity:
    """Identity in an attachment: ``{"controller": "<name>", "session": "<name>"}``, each of which may be
    missing. Raises BadCommand.

    Nobody checks the controller's name: it is for sites without users.
    """
    if not attachment:
        return Identity(Source.ZENOH, ANONYMOUS)
    wanted = Text.of("zenoh.attachment", form='{"controller": "<name>"}')
    if len(attachment) > _LONGEST:
        raise BadCommand(MALFORMED, wanted)
    said = _decoded(_controller, attachment, wanted)
    if not NAME.fullmatch(said.controller) or (said.session and not NAME.fullmatch(said.session)):
        raise BadCommand(MALFORMED, WANTED_NAME)
    connection = f"session {said.session}" if said.session else ""
    return Identity(Source.ZENOH, said.controller, connection=connection)


def session_of(attachment: bytes | None) -> str:
    """Connection that the attachment names; empty where it names none, whatever else is in it."""
    try:
        return identity_of(attachment).connection
    except BadCommand:
        return ""


class Commands:
    """Commands of a site, derived from its points."""

    def __init__(self, points: Iterable[Point]) -> None:
        self._points = {point.name: point for point in points}
        self._drives = _owners(self._points, "/command/control_word")
        self._with_parameters = _owners(self._points, "/supervision/sdo_abort_code")
        """The drives, and the nodes that are none."""
        self._with_outputs = frozenset(
            point.path[0] for point in self._points.values() if point.path[1:2] == ("output",)
        )
        """The nodes among them that somebody commands."""
        self._commanded = self._drives | self._with_outputs
        self._nodes = _owners(self._points, "/node/nmt_state")
        self._buses = _owners((name for name in self._points if name.startswith("bus/")), "/nmt_state")

    def is_method(self, tail: str) -> bool:
        """Whether the key is that of a method, not of a value."""
        owner, _, leaf = tail.rpartition("/")
        target, _, group = owner.rpartition("/")
        if group == "command" and target in self._drives:
            return leaf in METHODS
        if group == "command" and target in self._with_outputs:
            return leaf in OUTPUT_METHODS
        if owner in self._buses:
            return leaf in BUS_METHODS
        return group == "node" and target in self._nodes and leaf in NODE_METHODS

    def request(self, tail: str, payload: bytes, identity: Identity) -> Request:
        """The request for a payload on ``tail``, a key without prefix and site. Raises BadCommand.

        No payload is an empty one.
        """
        if len(payload) > _LONGEST:
            raise BadCommand(MALFORMED, Text.of("zenoh.too_long", most=_LONGEST))
        drive, name = self.parameter(tail)
        if name:
            return Request(identity, drive, WriteParameter(name, _decode_parameter(name, payload)))
        owner, _, leaf = tail.rpartition("/")
        target, _, group = owner.rpartition("/")
        if leaf == ("output" if owner in self._with_outputs else "command") and owner in self._commanded:
            return Request(identity, owner, Write(_decode_telegram(tail, payload)))
        if self.is_method(tail):
            return _call(identity, owner if owner in self._buses else target, Action(leaf), payload)
        point = self._points.get(tail)
        if point is None:
            raise self._unknown(tail, target, group)
        if not point.writable:
            raise BadCommand(Code.READ_ONLY, Text.of("zenoh.read_only", key=tail, drive=self._where(target)))
        if group == "supervision":
            return Request(identity, target, SetTimeout(_decode_whole(point, payload)))
        return Request(identity, target, Write({leaf: _decode_value(point, payload)}))

    def parameter(self, tail: str) -> tuple[str, str]:
        """The drive and the parameter's name if ``tail`` is ``<node>/<drive>/parameter/<name>``, a node that
        is no drive and the name if it is ``<node>/parameter/<name>``, else empty texts.

        The name may contain slashes (``C00039/1``); characters that a key cannot have (``* $ ? #``) or a tool
        does not take (``[ ]``) may be percent-encoded.
        """
        drive, found, name = tail.partition(_PARAMETER)
        return (drive, unquote(name)) if found and drive in self._with_parameters else ("", "")

    def addressee_of(self, tail: str) -> tuple[str, Action]:
        """For a key that is no command: the drive, node or bus it is about, or else the key itself; and the
        action."""
        drive, name = self.parameter(tail)
        if name:
            return drive, Action.WRITE_PARAMETER
        action = Action(tail.rpartition("/")[2]) if self.is_method(tail) else Action.WRITE
        target = tail
        while target and not (target in self._commanded or target in self._nodes or target in self._buses):
            target = target.rpartition("/")[0]
        return target or tail, action

    def reading(self, drive: str, name: str, identity: Identity, *, cached: bool) -> Request:
        """The request for a parameter's value, read from the drive or as last read."""
        age_ms = _CACHED_MS if cached else 0
        return Request(identity, drive, ReadParameter(name, age_ms))

    def _unknown(self, tail: str, target: str, group: str) -> BadCommand:
        if group == "command" and target in self._drives:
            leaves = [
                name.rpartition("/")[2] for name in self._points if name.startswith(f"{target}/command/")
            ]
            known = ", ".join((*leaves, *METHODS))
            return BadCommand(Code.UNKNOWN_POINT, _no_key(tail, f"{target}/command", known))
        if target in self._with_outputs and group in ("command", "output"):
            outputs = [
                name.rpartition("/")[2] for name in self._points if name.startswith(f"{target}/output/")
            ]
            known = ", ".join(OUTPUT_METHODS if group == "command" else outputs)
            return BadCommand(Code.UNKNOWN_POINT, _no_key(tail, f"{target}/{group}", known))
        if group == "node" and target in self._nodes:
            known = ", ".join(NODE_METHODS)
            return BadCommand(Code.UNKNOWN_POINT, Text.of("zenoh.no_key_of_node", key=tail, known=known))
        if group == "command":
            drives = ", ".join(sorted(self._drives))
            return BadCommand(Code.UNKNOWN_TARGET, Text.of("zenoh.no_drive", drive=target, known=drives))
        said = Text.of("zenoh.no_command", key=tail, drive=self._where(target))
        return BadCommand(Code.UNKNOWN_POINT, said)

    def _where(self, target: str) -> str:
        return target if target in self._drives else "<node>/<drive>"


def _no_key(key: str, group: str, known: str) -> Text:
    return Text.of("zenoh.no_key", key=key, group=group, known=known)


def _owners(points: Iterable[str], ending: str) -> frozenset[str]:
    return frozenset(name.removesuffix(ending) for name in points if name.endswith(ending))


def _decode_value(point: Point, payload: bytes) -> Value:
    bare = payload.strip()
    if point.data_type.is_integer and _HEXADECIMAL.fullmatch(bare.decode(errors="replace")):
        return int(bare, 16)
    wanted = Text.of("zenoh.number", name=point.name, form='{"v": <number>}')
    decoded = _decoded(_one_or_bare, bare, wanted)
    return _bounded(point.name, decoded.v if isinstance(decoded, _One) else decoded)


def _decode_whole(point: Point, payload: bytes) -> int:
    value = _decode_value(point, payload)
    if isinstance(value, bool) or not isinstance(value, int):
        raise BadCommand(Code.OUT_OF_RANGE, Text.of("zenoh.whole_number", name=point.name))
    return value


def _decode_parameter(name: str, payload: bytes) -> Value:
    """A number, a quoted text, true or false, or an object with one of these as ``v``; else the bare text,
    for instance a state's name."""
    bare = payload.strip()
    try:
        text = bare.decode()
    except UnicodeDecodeError:
        raise BadCommand(MALFORMED, Text.of("zenoh.value_or_text", name=name)) from None
    if not text:
        raise BadCommand(MALFORMED, Text.of("zenoh.empty", name=name))
    if _HEXADECIMAL.fullmatch(text):
        return int(text, 16)
    try:
        decoded = _one_or_bare.decode(bare)
    except msgspec.DecodeError as error:
        if text[0] in '{["':
            raise BadCommand(MALFORMED, _and(Text.of("zenoh.value", name=name), error)) from None
        return text
    return _bounded(name, decoded.v if isinstance(decoded, _One) else decoded)


def _decode_telegram(tail: str, payload: bytes) -> dict[str, Value]:
    wanted = Text.of("zenoh.telegram", name=tail, form='{"control_word": 1151}')
    values = _decoded(_telegram, payload, wanted)
    if not values:
        raise BadCommand(MALFORMED, Text.of("zenoh.names_no_point", name=tail))
    return {leaf: _bounded(leaf, value) for leaf, value in values.items()}


def _decoded(decoder: msgspec.json.Decoder[_Model], payload: bytes, wanted: Text) -> _Model:
    try:
        return decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise BadCommand(MALFORMED, _and(wanted, error)) from None


def _and(wanted: Text, error: Exception) -> Text:
    return Text.of("zenoh.not_decoded", wanted=wanted, error=str(error))


def _bounded(name: str, value: Value) -> Value:
    """JSON integers have no limit; no point has more than 32 bits."""
    if isinstance(value, int) and abs(value) >= 2**63:
        raise BadCommand(Code.OUT_OF_RANGE, Text.of("zenoh.too_large", name=name))
    return value


def _call(identity: Identity, target: str, action: Action, payload: bytes) -> Request:
    has_payload, named = bool(payload.strip()), Text.word("action", action)
    if not has_payload and action not in _WITHOUT_PAYLOAD:
        raise BadCommand(MALFORMED, Text.of("zenoh.needs_payload", action=named, enough="{}"))
    options = _CommandOptions()
    if has_payload:
        options = _decoded(_options, payload, Text.of("zenoh.options", action=named))
    ttl_ms, direction = options.ttl_ms, options.direction
    if ttl_ms is not msgspec.UNSET and action is not Action.TAKE_CONTROL:
        raise BadCommand(MALFORMED, Text.of("zenoh.no_option", action=named, option="ttl_ms"))
    if ttl_ms is not msgspec.UNSET and not 0 <= ttl_ms <= _LONGEST_MS:
        raise BadCommand(Code.OUT_OF_RANGE, Text.of("request.ttl_range", low=0, high=_LONGEST_MS))
    if direction is not msgspec.UNSET and action is not Action.START:
        raise BadCommand(MALFORMED, Text.of("zenoh.no_option", action=named, option="direction"))
    if direction not in (msgspec.UNSET, -1, 0, 1):
        raise BadCommand(Code.OUT_OF_RANGE, Text.of("zenoh.direction"))
    options_given = {"ttl_ms": ttl_ms, "direction": direction}
    given = {name: value for name, value in options_given.items() if value is not msgspec.UNSET}
    return Request(identity, target, command_of(action, **given))
