"""A python-can bus that sends through a running bridge: SDO requests and NMT commands.

The bridge carries them out in its own SDO queue and by its own rules; its answers come as frames. What the
nodes send by themselves is heard beside the bridge. Nothing else is sent.
"""

from __future__ import annotations

import base64
import logging
import queue
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import can

from bridge.canclient.gateway import GatewayClient, GatewayError
from bridge.canclient.hearing import Hearing
from bridge.canopen import abort, cobid
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.canopen.nmt import NmtCommand
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.core.sdo_server import SimulatedSdoServer

_log = logging.getLogger(__name__)

_RUNTIME_DIR: Final = "/run/drivebridge"
_NODES: Final = range(1, 128)
_MOST_BYTES: Final = 32 * 1024
"""Size of a value that fits a line of the gateway."""
_BLOCK_SEGMENTS: Final = 127
_MOST_WAITING: Final = 1 << 15
"""Frames that a script has not taken yet; further ones of the bus are lost, answers are not."""
_IDENTIFIER: Final = 0x1FFF_FFFF
_SDO: Final = range(cobid.SDO_REPLY, cobid.SDO_REQUEST + 0x80)
"""Conversations of the bridge, which are not the script's."""
_LSS: Final = (0x7E4, 0x7E5)
_NMT: Final = {
    NmtCommand.START: "start",
    NmtCommand.STOP: "stop",
    NmtCommand.ENTER_PRE_OPERATIONAL: "preop",
    NmtCommand.RESET_NODE: "reset node",
    NmtCommand.RESET_COMMUNICATION: "reset comm",
}
_NO_NODE: Final = 107
_ABORTS: Final = {102: 0x0800_0022, 103: abort.TIMED_OUT, 600: abort.OUT_OF_MEMORY}
"""SDO abort codes for the gateway's own error codes."""


class _NoNode(Exception):
    """The bridge has no such node: nobody answers."""


@dataclass(frozen=True, slots=True)
class _Object:
    """An object of a node, as an SDO server has it."""

    gateway: GatewayClient
    node_id: int
    index: int
    sub: int
    max_size: int = _MOST_BYTES

    def check_writable(self) -> None:
        """The bridge and the node know; they are asked with the value."""

    def upload(self) -> bytes:
        return base64.b64decode(self._ask(f"{self.node_id} r {self.index} {self.sub} d"))

    def download(self, data: bytes) -> None:
        self._ask(f"{self.node_id} w {self.index} {self.sub} d {base64.b64encode(data).decode()}")

    def _ask(self, command: str) -> str:
        try:
            return self.gateway.ask(command)
        except GatewayError as error:
            if error.code == _NO_NODE:
                raise _NoNode from None
            # python-canopen's error has a place for the code alone.
            _log.warning("node %d: %s", self.node_id, error)
            code = error.code if error.code >= 0x1000 else _ABORTS.get(error.code, abort.GENERAL)
            raise SdoAbort(code) from None


@dataclass(frozen=True, slots=True)
class _Objects:
    gateway: GatewayClient
    node_id: int

    def find(self, index: int, sub: int) -> _Object:
        return _Object(self.gateway, self.node_id, index, sub)


class DrivebridgeBus(can.BusABC):
    """``channel`` is ``<site>/<bus>``, or the path of the gateway's socket; ``runtime_dir`` is the site's.
    Without ``hears`` nothing is received but answers.

    Raises ``can.CanInitializationError`` where no bridge serves the gateway there, or has clients enough, and
    where the bus cannot be heard.
    """

    def __init__(
        self, channel: Any = None, runtime_dir: str = _RUNTIME_DIR, *, hears: bool = True, **kwargs: Any
    ) -> None:
        site, _, bus = str(channel).partition("/")
        is_path = str(channel).startswith(("/", "."))
        path = Path(str(channel)) if is_path else Path(runtime_dir) / f"{site}-{bus}.gateway"
        try:
            self._gateway = GatewayClient(path)
        except (FileNotFoundError, ConnectionRefusedError) as error:
            raise can.CanInitializationError(
                f'{path}: {error.strerror}; the bridge serves it where the site file has gateway = "socket"'
            ) from error
        except ConnectionError as error:
            raise can.CanInitializationError(
                f"{path}: the bridge has ended the connection; does it have clients enough?"
            ) from error
        except OSError as error:
            raise can.CanInitializationError(f"{path}: {error.strerror or error}") from error
        self._servers = {
            node: SimulatedSdoServer(_Objects(self._gateway, node), _BLOCK_SEGMENTS) for node in _NODES
        }
        self._received: queue.SimpleQueue[can.Message | can.CanOperationError] = queue.SimpleQueue()
        self._epoch = time.time() - time.monotonic()
        self._hearing = self._hear() if hears else None
        self.channel_info = f"drivebridge {channel}"
        super().__init__(channel=channel, **kwargs)

    def _hear(self) -> Hearing:
        place = ""
        try:
            place = self._gateway.ask("_frames")
            return Hearing(place, self._on_frame, self._on_deaf)
        except (OSError, GatewayError) as error:
            self._gateway.close()
            raise can.CanInitializationError(
                f"the bus cannot be heard at {place or 'the bridge'}: {error}; hears=False does without"
            ) from error

    def _on_frame(self, frame: Frame) -> None:
        identifier = frame.can_id & _IDENTIFIER
        is_extended = bool(frame.can_id & EXTENDED)
        if identifier in _SDO and not is_extended:
            return
        if self._received.qsize() >= _MOST_WAITING:
            return
        is_remote = bool(frame.can_id & REMOTE)
        self._received.put(
            can.Message(
                timestamp=self._epoch + frame.time,
                arbitration_id=identifier,
                is_extended_id=is_extended,
                is_remote_frame=is_remote,
                data=None if is_remote else frame.data,
                dlc=len(frame.data),
            )
        )

    def _on_deaf(self, why: str) -> None:
        self._received.put(can.CanOperationError(f"the bus is not heard any more: {why}"))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Carry out what ``msg`` asks; this returns when the bridge has answered. Raises
        ``can.CanOperationError`` for what the bridge does not do for others, or refuses."""
        node_id = msg.arbitration_id - cobid.SDO_REQUEST
        try:
            if node_id in _NODES and not msg.is_remote_frame:
                self._on_request(node_id, bytes(msg.data))
            elif msg.arbitration_id == cobid.NMT and len(msg.data) == 2:
                self._on_nmt(msg.data[0], msg.data[1])
            else:
                raise can.CanOperationError(_why_not_sent(msg))
        except OSError as error:
            raise can.CanOperationError(f"the bridge does not answer: {error}") from error

    def _send_periodic_internal(
        self, msgs: Sequence[can.Message] | can.Message, *_: object, **__: object
    ) -> can.broadcastmanager.CyclicSendTaskABC:
        """Refuse cyclic frames: raises ``can.CanOperationError`` here, and not in the thread that would send
        them."""
        first = msgs if isinstance(msgs, can.Message) else msgs[0]
        raise can.CanOperationError(_why_not_sent(first))

    def _on_request(self, node_id: int, data: bytes) -> None:
        try:
            answers = self._servers[node_id].on_request(data)
        except _NoNode:
            return
        for answer in answers:
            self._received.put(
                can.Message(
                    timestamp=time.time(),
                    arbitration_id=cobid.SDO_REPLY + node_id,
                    is_extended_id=False,
                    data=answer,
                )
            )

    def _on_nmt(self, octet: int, node_id: int) -> None:
        try:
            self._gateway.ask(f"{node_id} {_NMT[NmtCommand(octet)]}")
        except ValueError:
            raise can.CanOperationError(f"{octet:02X}h is no NMT command") from None
        except GatewayError as error:
            raise can.CanOperationError(f"the bridge refuses NMT for node {node_id}: {error}") from None

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            received = self._received.get(timeout=timeout)
        except queue.Empty:
            return None, False
        if isinstance(received, can.CanOperationError):
            raise received
        return received, False

    def shutdown(self) -> None:
        super().shutdown()
        if self._hearing:
            self._hearing.close()
        self._gateway.close()


def _why_not_sent(msg: can.Message) -> str:
    """Reason why ``msg`` is not sent: whose frame it is, and what to use instead."""
    can_id, is_remote = msg.arbitration_id, msg.is_remote_frame
    if can_id == cobid.SYNC:
        instead = "SYNC is the bridge's: sync_period_ms of the bus in the site file"
    elif can_id in _LSS:
        instead = "LSS reaches every device: `drivebridge lss`, while the bridge does not run"
    elif can_id - cobid.ERROR_CONTROL in _NODES:
        instead = "error control is the bridge's: supervision of the node in the site file"
    elif is_remote:
        instead = "the bridge asks for what its site file has"
    elif cobid.is_for_pdos(can_id):
        instead = "process data is the bridge's: command the drive by OPC UA, Modbus or zenoh"
    else:
        instead = "through a bridge there are SDO and NMT"
    return f"{can_id:X}h is not sent: {instead}"
