"""Lines of CiA 309-3 into commands: ``"[" sequence "]" [[net] node] command``. Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final

from bridge.command import Action
from bridge.northbound.gateway.cia309_types import TYPES, BadText, encode

LONGEST_LINE: Final = 64 * 1024
"""In bytes: room for a domain of about 48 kB in base64."""
_MOST_WORDS: Final = 4096
_MOST_SEQUENCE: Final = 0xFFFF_FFFF
_SEQUENCE: Final = re.compile(r"\s*\[\s*([0-9]{1,10})\s*\]", re.ASCII)
_WORD: Final = re.compile(r'\s*(?:"((?:[^"]|"")*)"(?=\s|$)|([^\s"]+))')
_NUMBER: Final = re.compile(r"0x[0-9a-f]{1,8}|[0-9]{1,10}", re.IGNORECASE | re.ASCII)


class ErrorCode(IntEnum):
    """Error codes of the gateway itself (CiA 309-3); those of a node are SDO abort codes."""

    NOT_SUPPORTED = 100
    SYNTAX = 101
    INTERNAL_STATE = 102
    TIMED_OUT = 103
    NO_DEFAULT_NET = 104
    NO_DEFAULT_NODE = 105
    UNSUPPORTED_NET = 106
    UNSUPPORTED_NODE = 107
    OUT_OF_MEMORY = 600


class BadLine(Exception):
    """A line that is no command here."""

    def __init__(self, code: ErrorCode) -> None:
        super().__init__(code.name)
        self.code = code


class GatewaySetting(Enum):
    NETWORK = "network"
    NODE = "node"
    SDO_TIMEOUT = "sdo_timeout"
    COMMAND_TIMEOUT = "command_timeout"
    SDO_BLOCK = "sdo_block"


@dataclass(frozen=True, slots=True)
class GatewayRead:
    """``kind`` is a data type of 309-3."""

    index: int
    sub: int
    kind: str


@dataclass(frozen=True, slots=True)
class GatewayWrite:
    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class GatewayNmt:
    action: Action


@dataclass(frozen=True, slots=True)
class Set:
    setting: GatewaySetting
    value: int


@dataclass(frozen=True, slots=True)
class Version:
    """``info version``."""


@dataclass(frozen=True, slots=True)
class Frames:
    """``_frames``, a command of our own: where the frames of the bus can be heard."""


Command = GatewayRead | GatewayWrite | GatewayNmt | Set | Version | Frames


@dataclass(frozen=True, slots=True)
class CommandLine:
    """A command, and the net and node that its line names."""

    command: Command
    net: int | None = None
    node: int | None = None


_NMT: Final = {
    "start": Action.START_NODE,
    "stop": Action.STOP_NODE,
    "preop": Action.ENTER_PRE_OPERATIONAL,
    "preoperational": Action.ENTER_PRE_OPERATIONAL,
    "reset node": Action.RESET,
    "reset comm": Action.RESET_COMMUNICATION,
    "reset communication": Action.RESET_COMMUNICATION,
}
_OTHERS: Final = ("enable", "disable", "info", "set", "init", "help", "led", "log")
"""First words of commands that the standard, or a widespread gateway, has."""


def split_sequence(text: str) -> tuple[int, str]:
    """The sequence number of a line and what follows it. Raises ``BadLine``."""
    match = _SEQUENCE.match(text)
    if match is None or int(match[1]) > _MOST_SEQUENCE:
        raise BadLine(ErrorCode.SYNTAX)
    return int(match[1]), text[match.end() :]


def parse(text: str) -> CommandLine:
    """The command in what follows the sequence number. Raises ``BadLine``, also where there is none."""
    words = _words(text)
    places: list[int] = []
    while words and len(places) < 2 and _NUMBER.fullmatch(words[0]):
        places.append(_number(words.pop(0)))
    if not words:
        raise BadLine(ErrorCode.SYNTAX)
    command = _command(words)
    if isinstance(command, Set) and places:
        if len(places) > 1:
            raise BadLine(ErrorCode.SYNTAX)
        return CommandLine(command, net=places[0])
    node = places.pop() if places else None
    return CommandLine(command, places.pop() if places else None, node)


def _words(text: str) -> list[str]:
    """Words and texts in double quotes, up to a comment."""
    found: list[str] = []
    place = 0
    while rest := text[place:].lstrip()[:1]:
        if rest == "#":
            break
        match = _WORD.match(text, place)
        if match is None or len(found) >= _MOST_WORDS:
            raise BadLine(ErrorCode.SYNTAX)
        found.append(match[2] if match[1] is None else match[1].replace('""', '"'))
        place = match.end()
    return found


def _command(words: list[str]) -> Command:
    first, rest = words[0].lower(), words[1:]
    nmt = _NMT.get(" ".join(words).lower())
    if nmt is not None:
        return GatewayNmt(nmt)
    if first in ("r", "read"):
        if len(rest) not in (2, 3):
            raise BadLine(ErrorCode.SYNTAX)
        index, sub = _object(rest)
        return GatewayRead(index, sub, _kind(rest[2]) if len(rest) == 3 else "hex")
    if first in ("w", "write"):
        if len(rest) < 4:
            raise BadLine(ErrorCode.SYNTAX)
        index, sub = _object(rest)
        try:
            return GatewayWrite(index, sub, encode(_kind(rest[2]), rest[3:]))
        except BadText:
            raise BadLine(ErrorCode.SYNTAX) from None
    if first == "set" and len(rest) == 2:
        try:
            return Set(GatewaySetting(rest[0].lower()), _number(rest[1]))
        except ValueError:
            raise BadLine(ErrorCode.NOT_SUPPORTED) from None
    if [first, *(word.lower() for word in rest)] == ["info", "version"]:
        return Version()
    if words == ["_frames"]:
        return Frames()
    is_known = first in _OTHERS or first.startswith(("lss_", "_"))
    raise BadLine(ErrorCode.NOT_SUPPORTED if is_known else ErrorCode.SYNTAX)


def _object(words: list[str]) -> tuple[int, int]:
    index, sub = _number(words[0]), _number(words[1])
    if index > 0xFFFF or sub > 0xFF:
        raise BadLine(ErrorCode.SYNTAX)
    return index, sub


def _kind(word: str) -> str:
    if word.lower() not in TYPES:
        raise BadLine(ErrorCode.SYNTAX)
    return word.lower()


def _number(word: str) -> int:
    if not _NUMBER.fullmatch(word):
        raise BadLine(ErrorCode.SYNTAX)
    return int(word, 16 if word[:2].lower() == "0x" else 10)
