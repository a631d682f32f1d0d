"""A python-can bus without a CAN interface: SDO requests and NMT commands go to a running bridge.

The bridge carries them out in its own SDO queue and by its own rules; its answers come as frames. Nothing
else of the bus is seen, and nothing else is sent.
"""

from __future__ import annotations

import base64
import queue
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import can

from bridge.canclient.gateway import GatewayClient, GatewayError
from bridge.canopen import abort, cobid
from bridge.canopen.nmt import NmtCommand
from bridge.sim.abort import SdoAbort
from bridge.sim.sdo_server import SdoServer

_RUNTIME_DIR: Final = "/run/drivebridge"
_NODES: Final = range(1, 128)
_MOST_BYTES: Final = 32 * 1024
"""Of one value: fits a line of the gateway."""
_BLOCK_SEGMENTS: Final = 127
_NMT: Final = {
    NmtCommand.START: "start",
    NmtCommand.STOP: "stop",
    NmtCommand.ENTER_PRE_OPERATIONAL: "preop",
    NmtCommand.RESET_NODE: "reset node",
    NmtCommand.RESET_COMMUNICATION: "reset comm",
}
_NO_NODE: Final = 107
_ABORTS: Final = {102: 0x0800_0022, 103: abort.TIMED_OUT, 600: abort.OUT_OF_MEMORY}
"""What the gateway says itself, as an SDO server says it."""


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

    Raises ``can.CanInitializationError`` where no bridge serves the gateway there, or has clients enough.
    """

    def __init__(self, channel: Any = None, runtime_dir: str = _RUNTIME_DIR, **kwargs: Any) -> None:
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
        self._servers = {node: SdoServer(_Objects(self._gateway, node), _BLOCK_SEGMENTS) for node in _NODES}
        self._received: queue.SimpleQueue[can.Message] = queue.SimpleQueue()
        self.channel_info = f"drivebridge {channel}"
        super().__init__(channel=channel, **kwargs)

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
                raise can.CanOperationError(
                    f"{msg.arbitration_id:X}h is not sent: through a bridge there are SDO and NMT"
                )
        except OSError as error:
            raise can.CanOperationError(f"the bridge does not answer: {error}") from error

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
            return self._received.get(timeout=timeout), False
        except queue.Empty:
            return None, False

    def shutdown(self) -> None:
        super().shutdown()
        self._gateway.close()
