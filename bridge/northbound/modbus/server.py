"""The Modbus TCP server: the listening socket, who may connect, and the list of sessions."""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import logging
import os
import socket
from collections.abc import Callable
from typing import Final

from bridge.command import Identity, Plant, Role, Source
from bridge.config import ModbusTable
from bridge.errors import Unavailable
from bridge.northbound.modbus.dispatch import Dispatcher
from bridge.northbound.modbus.session import READ_MOST, Session
from bridge.northbound.pulse import Pulse

_log = logging.getLogger(__name__)

_LOG_PAUSE_S: Final = 60.0
_BACKLOG: Final = 64
_WINDOW: Final = 4 * READ_MOST
"""Bytes that may wait in the kernel: more than are read at once, so that who fills it is noticed."""

IpAddress = ipaddress.IPv4Address | ipaddress.IPv6Address


class ModbusServer:
    """Serves ``plant`` as ``settings`` say. ``clock`` gives monotonic seconds, the plant's time."""

    def __init__(self, plant: Plant, settings: ModbusTable, clock: Callable[[], float]) -> None:
        self._settings = settings
        self._plant = plant
        self._dispatcher = Dispatcher(plant, settings.word_order, clock)
        self._allowed = [ipaddress.ip_network(network) for network in settings.allow]
        self._clock = clock
        self._pulse = Pulse(clock)
        self._sessions: set[Session] = set()
        self._server: asyncio.Server | None = None
        self._logged: dict[str, float] = {}
        self.refused_connections = 0
        self.broken_connections = 0
        """Connections that we ended: not Modbus, a client that did not read its answers, or one that made
        room for another."""

    @property
    def port(self) -> int:
        """The port that is listened on. Raises RuntimeError before ``start``."""
        if self._server is None:
            raise RuntimeError("the server is not started")
        return self._server.sockets[0].getsockname()[1]

    @property
    def sessions(self) -> int:
        return len(self._sessions)

    async def start(self) -> None:
        """Listen. Raises ``Unavailable`` with the sentence that helps where that cannot be."""
        sock = _listen(self._settings.listen)
        loop = asyncio.get_running_loop()
        self._pulse.start()
        self._server = await loop.create_server(
            lambda: Session(self._dispatcher, self, self._clock, self._pulse), sock=sock, backlog=_BACKLOG
        )
        _log.info("Modbus TCP on %s", self._settings.listen)

    async def close(self) -> None:
        """Stop listening and end every session."""
        server, self._server = self._server, None
        if server is None:
            return
        self._pulse.stop()
        server.close()
        for session in tuple(self._sessions):
            session.close()
        await server.wait_closed()

    # what sessions ask and tell

    def admit(self, session: Session, host: str, port: int) -> Identity | None:
        """The identity of a client, or None where its address may not connect."""
        address = _normalised(host)
        if not any(address in network for network in self._allowed):
            self.refused_connections += 1
            why = "it is in none of the networks of modbus.allow"
            self._warn("connection of %s refused: %s", str(address), why)
            return None
        if len(self._sessions) >= self._settings.max_connections:
            self._make_room()
        self._sessions.add(session)
        shown = f"[{address}]" if address.version == 6 else str(address)
        sets = self._settings.parameters == "write"
        return Identity(Source.MODBUS, str(address), Role.OPERATOR, f"{shown}:{port}", sets)

    def leave(self, session: Session) -> None:
        self._sessions.discard(session)

    def on_fault(self, session: Session, fault: str) -> None:
        self.broken_connections += 1
        self._warn("connection of %s closed: %s", session.address, fault)

    def _make_room(self) -> None:
        """End the connection that is missed least: idle clients must not lock the PLC out."""
        owners = [drive.channel.owner for drive in self._plant.drives.values()]

        def is_missed(session: Session) -> tuple[bool, float]:
            identity = session.identity
            return identity is not None and any(map(identity.is_same, owners)), session.heard_at

        idlest = min(self._sessions, key=is_missed)
        self.broken_connections += 1
        self._warn(
            "connection of %s closed to make room: there are %s, and it was idle the longest",
            idlest.address,
            str(len(self._sessions)),
        )
        self._sessions.discard(idlest)
        idlest.close()

    def _warn(self, message: str, *details: str) -> None:
        """Log at most once a minute per message: what a stranger sends must not fill a disk."""
        now = self._clock()
        if now - self._logged.get(message, -_LOG_PAUSE_S) >= _LOG_PAUSE_S:
            self._logged[message] = now
            _log.warning(message, *details)


def _normalised(host: str) -> IpAddress:
    """An IPv4 client of an IPv6 socket is the IPv4 client it is."""
    address = ipaddress.ip_address(host)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped:
        return address.ipv4_mapped
    return address


def _listen(endpoint: str) -> socket.socket:
    host, _, port = endpoint.rpartition(":")
    host = host.strip("[]")
    is_v6 = ":" in host
    try:
        sock = socket.create_server(
            (host, int(port)),
            family=socket.AF_INET6 if is_v6 else socket.AF_INET,
            backlog=_BACKLOG,
            dualstack_ipv6=host == "::" and socket.has_dualstack_ipv6(),
        )
        # Connections inherit it; set later, it would not narrow the window that they begin with.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WINDOW)
        return sock
    except OSError as error:
        raise Unavailable(f"modbus.listen = {endpoint!r}: {_advice(error, host, port)}") from error


def _advice(error: OSError, host: str, port: str) -> str:
    match error.errno:
        case errno.EADDRINUSE:
            return f"port {port} is taken by another program; `ss -ltnp` shows which, or choose another port"
        case errno.EACCES:
            where = "start it as drivebridge.service, or choose a port from 1024 on"
            return f"port {port} needs CAP_NET_BIND_SERVICE: {where}"
        case errno.EADDRNOTAVAIL:
            return f"no interface of this machine has the address {host}"
        case _:
            return os.strerror(error.errno) if error.errno else str(error)
