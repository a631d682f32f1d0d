"""One client of the gateway: bytes and outcomes in, requests and lines out. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from bridge.canopen import abort
from bridge.command import Code, Do, Identity, Outcome, ReadParameter, Reply, Request, WriteParameter
from bridge.northbound.gateway.cia309_types import BadText, decode
from bridge.northbound.gateway.syntax import (
    LONGEST_LINE,
    BadLine,
    ErrorCode,
    Frames,
    GatewayNmt,
    GatewayRead,
    GatewaySetting,
    GatewayWrite,
    Set,
    Version,
    parse,
    split_sequence,
)

MOST_PENDING: Final = 8
"""Commands of one client whose answers are still to come; it is told of each beyond (error 600)."""
_COMMAND_TIMEOUT_MS: Final = 60_000
_LONGEST_TIMEOUT_MS: Final = 3_600_000
_TYPE_MISMATCH: Final = 0x0607_0010
_SDO_CODES: Final = {
    Code.READ_ONLY: 0x0601_0002,
    Code.WRITE_ONLY: 0x0601_0001,
    Code.OUT_OF_RANGE: 0x0609_0030,
    Code.NOT_VALID: 0x0609_0030,
    # Not now, or not for this client: "because of local control".
    Code.NOT_ALLOWED: 0x0800_0021,
    Code.TOO_OFTEN: 0x0800_0020,
    Code.BUSY: abort.BUSY,
    Code.OTHER_VALUE: 0x0800_0022,
}
"""SDO abort codes for refusals of the bridge itself."""
_CODES: Final = {
    Code.TIMED_OUT: ErrorCode.TIMED_OUT,
    Code.UNKNOWN_TARGET: ErrorCode.UNSUPPORTED_NODE,
    Code.NOT_CONFIGURED: ErrorCode.NOT_SUPPORTED,
}


@dataclass(frozen=True, slots=True)
class Net:
    """A bus: its number as clients name it, what NMT for all its nodes is addressed to, and by node id each
    node and whose parameters its first SDO channel reaches (None where that is nobody)."""

    number: int
    target: str
    nodes: Mapping[int, tuple[str, str | None]]
    version: str = "0 0 0 0 0 3.00 0.0"
    """The answer to ``info version``."""
    frames: str = ""
    """The answer to ``_frames``: ``socketcan`` with the interface, or ``tap`` with the path of the socket
    that passes them on."""


Submit = Callable[[Request, Reply], None]


@dataclass(slots=True)
class _Defaults:
    net: int | None = None
    node: int | None = None
    timeout_s: float = _COMMAND_TIMEOUT_MS / 1000


@dataclass(slots=True)
class _Pending:
    sequence: int
    deadline: float
    asks_for: str
    """The object, as ``6083h:00``, or the target of an NMT command."""
    is_open: bool = field(default=True)


class GatewaySession:
    """``submit`` hands a request to the bridge. ``on_lines`` is called when a line has come outside of
    ``receive`` and ``on_time``. Times are monotonic seconds."""

    def __init__(
        self, net: Net, identity: Identity, submit: Submit, on_lines: Callable[[], None] = lambda: None
    ) -> None:
        self._net = net
        self._identity = identity
        self._submit = submit
        self._on_lines = on_lines
        self._defaults = _Defaults(net=net.number)
        self._buffer = bytearray()
        self._skips = False
        self._pending: list[_Pending] = []
        self._lines: list[str] = []
        self._is_working = False

    @property
    def pending(self) -> int:
        return len(self._pending)

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes of the client: whole lines are carried out, the rest waits for more."""
        self._is_working = True
        try:
            for piece in data.splitlines(keepends=True) if data else ():
                self._take(piece, now)
        finally:
            self._is_working = False

    def _take(self, piece: bytes, now: float) -> None:
        ends = piece.endswith((b"\n", b"\r"))
        if not self._skips:
            self._buffer += piece
        if len(self._buffer) > LONGEST_LINE:
            self._buffer.clear()
            self._skips = True
            self._answer(0, ErrorCode.SYNTAX)
        if not ends:
            return
        line, self._skips = bytes(self._buffer), False
        self._buffer.clear()
        self._on_line(line.decode("utf-8", "replace"), now)

    def _on_line(self, line: str, now: float) -> None:
        if not line.strip() or line.lstrip().startswith("#"):
            return
        sequence = 0
        try:
            sequence, rest = split_sequence(line)
            found = parse(rest)
            match found.command:
                case Set():
                    self._check_net(found.net)
                    self._set(found.command)
                    self._say(sequence, "OK")
                case Version():
                    self._check_net(found.net)
                    self._say(sequence, self._net.version)
                case Frames():
                    self._say(sequence, self._net.frames)
                case GatewayNmt(action):
                    self._check_net(found.net)
                    target = self._nmt_target(found.node)
                    self._ask(sequence, Request(self._identity, target, Do(action)), target, now)
                case GatewayRead(index, sub, kind):
                    command = ReadParameter(f"{index:04X}:{sub:02X}", raw=True)
                    request = Request(self._identity, self._drive(found.net, found.node), command)
                    self._ask(sequence, request, f"{index:04X}h:{sub:02X}", now, kind)
                case GatewayWrite(index, sub, data):
                    written = WriteParameter(f"{index:04X}:{sub:02X}", data.hex(" ").upper(), raw=True)
                    request = Request(self._identity, self._drive(found.net, found.node), written)
                    self._ask(sequence, request, f"{index:04X}h:{sub:02X}", now)
        except BadLine as error:
            self._answer(sequence, error.code)

    # where to

    def _check_net(self, given: int | None) -> None:
        net = self._defaults.net if given is None else given
        if net is None:
            raise BadLine(ErrorCode.NO_DEFAULT_NET)
        if net != self._net.number:
            raise BadLine(ErrorCode.UNSUPPORTED_NET)

    def _node(self, given: int | None) -> int:
        node = self._defaults.node if given is None else given
        if node is None:
            raise BadLine(ErrorCode.NO_DEFAULT_NODE)
        return node

    def _nmt_target(self, given: int | None) -> str:
        node = self._node(given)
        if node == 0:
            return self._net.target
        if node not in self._net.nodes:
            raise BadLine(ErrorCode.UNSUPPORTED_NODE)
        return self._net.nodes[node][0]

    def _drive(self, net: int | None, given: int | None) -> str:
        self._check_net(net)
        found = self._net.nodes.get(self._node(given))
        if found is None:
            raise BadLine(ErrorCode.UNSUPPORTED_NODE)
        if found[1] is None:
            raise BadLine(ErrorCode.NOT_SUPPORTED)
        return found[1]

    def _set(self, command: Set) -> None:
        match command.setting:
            case GatewaySetting.NETWORK:
                if command.value != self._net.number:
                    raise BadLine(ErrorCode.UNSUPPORTED_NET)
                self._defaults.net = command.value
            case GatewaySetting.NODE:
                if command.value not in range(128):
                    raise BadLine(ErrorCode.UNSUPPORTED_NODE)
                self._defaults.node = command.value
            case GatewaySetting.COMMAND_TIMEOUT:
                if command.value not in range(1, _LONGEST_TIMEOUT_MS + 1):
                    raise BadLine(ErrorCode.SYNTAX)
                self._defaults.timeout_s = command.value / 1000
            case GatewaySetting.SDO_TIMEOUT | GatewaySetting.SDO_BLOCK:
                # The site file's for everybody; blocks are used where the node offers them.
                raise BadLine(ErrorCode.NOT_SUPPORTED)

    # requests and their ends

    def _ask(
        self, sequence: int, request: Request, asks_for: str, now: float, kind: str | None = None
    ) -> None:
        if len(self._pending) >= MOST_PENDING:
            raise BadLine(ErrorCode.OUT_OF_MEMORY)
        pending = _Pending(sequence, now + self._defaults.timeout_s, asks_for)
        self._pending.append(pending)
        self._submit(request, partial(self._on_outcome, pending, kind, isinstance(request.command, Do)))

    def _on_outcome(self, pending: _Pending, kind: str | None, is_nmt: bool, outcome: Outcome) -> None:
        if not pending.is_open:
            return
        self._close(pending)
        if not outcome.ok:
            reason = _reason(outcome)
            why = reason if pending.asks_for in reason else f"{pending.asks_for}: {reason}"
            self._answer(pending.sequence, _error(outcome, is_nmt=is_nmt), why)
        elif kind is None:
            self._say(pending.sequence, "OK")
        else:
            try:
                text = decode(kind, bytes.fromhex(str(outcome.value)))
            except BadText:
                self._answer(pending.sequence, _TYPE_MISMATCH, f"{pending.asks_for}: no {kind}")
            else:
                self._say(pending.sequence, text)
        if not self._is_working:
            self._on_lines()

    def on_time(self, now: float) -> None:
        """Tell of every command whose time is up; its transfer goes on, and its answer is dropped."""
        for pending in [one for one in self._pending if now >= one.deadline]:
            self._close(pending)
            self._answer(pending.sequence, ErrorCode.TIMED_OUT)

    def next_deadline(self) -> float | None:
        return min((one.deadline for one in self._pending), default=None)

    def close(self) -> None:
        """The client is gone: nobody waits for answers."""
        for pending in self._pending:
            pending.is_open = False
        self._pending.clear()
        self._lines.clear()

    def _close(self, pending: _Pending) -> None:
        pending.is_open = False
        self._pending.remove(pending)

    # lines

    def take_lines(self) -> bytes:
        """Bytes to be sent to the client."""
        lines, self._lines = self._lines, []
        return "".join(lines).encode("utf-8")

    def _answer(self, sequence: int, code: int, why: str = "") -> None:
        """``why`` goes behind the code as a comment, as gateways of CANopenNode have it."""
        said = f"ERROR:{int(code)}" if isinstance(code, ErrorCode) else f"ERROR:0x{code:08X}"
        self._say(sequence, f"{said} #{' '.join(why.split())}" if why else said)

    def _say(self, sequence: int, text: str) -> None:
        self._lines.append(f"[{sequence}] {text}\r\n")


def _reason(outcome: Outcome) -> str:
    """The bridge's sentence, or what the code means."""
    return outcome.message or abort.TEXTS.get(outcome.abort_code or 0) or outcome.code.value


def _error(outcome: Outcome, *, is_nmt: bool) -> int:
    if outcome.abort_code:
        return outcome.abort_code
    if not is_nmt and outcome.code in _SDO_CODES:
        return _SDO_CODES[outcome.code]
    return _CODES.get(outcome.code, ErrorCode.INTERNAL_STATE)
