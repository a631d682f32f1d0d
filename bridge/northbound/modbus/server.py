"""The Modbus TCP server: the listening socket, who may connect, and the list of sessions."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import socket
from collections.abc import Callable
from math import inf
from typing import Final

from bridge.base.admission import Admission, ConnectionStage, Limits, Visitor
from bridge.base.notices import teller
from bridge.base.quietlog import log_source
from bridge.base.sources import source_of
from bridge.command import Identity, Role, Source
from bridge.config import ModbusTable
from bridge.northbound.listening import listen, until_deaf
from bridge.northbound.modbus.connection import READ_MOST, ModbusConnection
from bridge.northbound.modbus.dispatch import Dispatcher
from bridge.northbound.modbus.rounds import Rounds
from bridge.northbound.modbus.units import Units
from bridge.northbound.pulse import Pulse
from bridge.northbound.view import View

_log = logging.getLogger(__name__)

_WINDOW: Final = 4 * READ_MOST
"""Bytes that may wait in the kernel: more than are read at once, so that a client that fills it is
noticed."""

IpAddress = ipaddress.IPv4Address | ipaddress.IPv6Address


class ModbusServer:
    """Serves ``units`` as ``settings`` say. ``clock`` gives monotonic seconds."""

    def __init__(self, view: View, units: Units, settings: ModbusTable, clock: Callable[[], float]) -> None:
        self._settings = settings
        self._view = view
        self._dispatcher = Dispatcher(view, units, settings.word_order, clock)
        owned = [drive.drive_name for drive in units.drives]
        owned += [device.device_name for device in units.devices if device.has_outputs]
        self._owners = [view.image.index[f"{name}/supervision/owner"] for name in owned]
        self._allowed = [ipaddress.ip_network(network) for network in settings.allow]
        self._clock = clock
        self.pulse = Pulse(clock)
        """Beat of the event loop in which its connections are read."""
        self._sessions: set[ModbusConnection] = set()
        self._admission = Admission(
            _limits(settings.max_connections), teller("Modbus"), self._count_refused, self._count_broken
        )
        self._owner_names: frozenset[str] = frozenset()
        self.rounds = Rounds(lambda go_on: asyncio.get_running_loop().call_soon(go_on))
        """Turns in which requests are handled."""
        self._writers: dict[str, set[ModbusConnection]] = {}
        """Sessions of each address that have written."""
        self._server: asyncio.Server | None = None
        self._socket: socket.socket | None = None

    @property
    def port(self) -> int:
        """The port on which it listens. Raises RuntimeError before ``start``."""
        if self._server is None:
            raise RuntimeError("the server is not started")
        return self._server.sockets[0].getsockname()[1]

    async def start(self) -> None:
        """Listen, or listen again after ``failed``. Raises ``Unavailable`` with advice."""
        is_first = self._server is None
        if self._server:
            # Only the listening socket has ended: existing connections go on.
            self._server.close()
        sock = self._socket = listen(self._settings.listen, "modbus.listen")
        loop = asyncio.get_running_loop()
        # Connections inherit it; set later, it would not reduce the window that they begin with.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WINDOW)
        if is_first:
            self.pulse.start()
        self._server = await loop.create_server(self.connection, sock=sock)
        _log.info("Modbus TCP on %s", self._settings.listen)

    def connection(self) -> ModbusConnection:
        """A connection for whoever has accepted one."""
        return ModbusConnection(self._dispatcher, self, self._clock, self.pulse)

    async def failed(self) -> None:
        """Wait until nobody can connect any more, then raise ``OperationFailed``."""
        if self._socket:
            await until_deaf(self._socket, "modbus.listen")

    async def close(self) -> None:
        """Stop listening and end every session."""
        server, self._server = self._server, None
        if server is None:
            return
        self.pulse.stop()
        server.close()
        for session in tuple(self._sessions):
            session.close()
        await server.wait_closed()

    # what sessions ask and tell

    def admit(self, session: ModbusConnection, host: str, port: int) -> Identity | None:
        """The identity of a client, or None if its address may not connect."""
        address = _normalised(host)
        if not any(address in network for network in self._allowed):
            self._count_refused()
            _log.warning(
                "connection of %s refused: it is in none of the networks of modbus.allow",
                address,
                extra=log_source(source_of(str(address))),
            )
            return None
        self._owner_names = frozenset(map(str, self._view.image.values(self._owners)))
        source = source_of(str(address))
        visitor = session.visitor = Visitor(
            source, self._clock(), lambda: self._stage(session), lambda: self._end(session)
        )
        if not self._admission.admit(visitor, visitor.since):
            return None
        self._sessions.add(session)
        self.rounds.enter(session, source)
        shown = f"[{address}]" if address.version == 6 else str(address)
        sets = self._settings.parameters == "write"
        who = Source.MODBUS, str(address), Role.OPERATOR, f"{shown}:{port}"
        identity = Identity(*who, sets, connection=f"port {port}")
        self._view.on_connection(identity, is_there=True, has_others=self._has_others(identity, session))
        return identity

    def leave(self, session: ModbusConnection) -> None:
        """Forget a session: its client has closed the connection, or it is closed for another reason."""
        self._forget(session)
        identity = session.identity
        if identity is None:
            return
        writers = self._writers.get(identity.user, set())
        writers.discard(session)
        if not writers:
            self._writers.pop(identity.user, None)
        has_others = self._has_others(identity, session)
        self._view.on_connection(identity, is_there=False, has_others=has_others)

    def on_write(self, session: ModbusConnection, identity: Identity) -> None:
        """``session`` is about to write. A client that has closed one connection before it goes on over the
        next must not depend on which of the two the loop reads first: those that the kernel knows to be
        closed end now, and nothing that still waits on them comes after what it has said since."""
        writers = self._writers.setdefault(identity.user, set())
        writers.add(session)
        if len(writers) > 1:
            for other in [one for one in writers if one is not session and one.has_been_closed]:
                self.leave(other)
                other.close()

    def _has_others(self, identity: Identity, session: ModbusConnection) -> bool:
        return any(one is not session and identity.is_same(one.identity) for one in self._sessions)

    def on_fault(self, session: ModbusConnection, fault: str) -> None:
        """The session is closed for this reason."""
        self._count_broken()
        _log.warning("connection of %s closed: %s", session.address, fault, extra=log_source(session.source))

    def _count_refused(self) -> None:
        self._view.count("modbus_refused_connections")

    def _count_broken(self) -> None:
        self._view.count("modbus_broken_connections")

    def _stage(self, session: ModbusConnection) -> ConnectionStage:
        """Connections of addresses that own a drive stay, as long as the address has no more than half of
        all."""
        identity, visitor = session.identity, session.visitor
        has_share = visitor is not None and self._admission.count_of(visitor.source) <= max(
            1, self._settings.max_connections // 2
        )
        if has_share and identity is not None and str(identity) in self._owner_names:
            return ConnectionStage.SESSION
        return ConnectionStage.GREETED if session.has_spoken else ConnectionStage.CONNECTED

    def _end(self, session: ModbusConnection) -> None:
        """Close a session to make room for another one."""
        self._forget(session)
        session.close()

    def _forget(self, session: ModbusConnection) -> None:
        self._sessions.discard(session)
        self.rounds.leave(session)
        if session.visitor is not None:
            self._admission.leave(session.visitor)


def _limits(connections: int) -> Limits:
    """Limits by which the address with most connections makes room, so that a crowd pushes out itself: of its
    connections one that has said nothing yet, else the one idle longest. Clients connect once and stay, so
    idle ones have no time that is up."""
    return Limits(connections, connections, connections, slow_s=inf, all_yield=True)


def _normalised(host: str) -> IpAddress:
    """An IPv4 client on an IPv6 socket is known by its IPv4 address."""
    address = ipaddress.ip_address(host)
    if isinstance(address, ipaddress.IPv6Address) and address.ipv4_mapped:
        return address.ipv4_mapped
    return address
