"""No connection of ours waits in close, whoever has asked for that."""

from __future__ import annotations

import errno
import os
import socket
import struct
from pathlib import Path

import pytest

from bridge.zenohlink.sockets import TcpConnections

TEN_SECONDS = struct.pack("ii", 1, 10)


def lingers(connection: socket.socket) -> bool:
    state = connection.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, len(TEN_SECONDS))
    return struct.unpack("ii", state)[0] != 0


def files() -> set[str]:
    return {file.name for file in Path("/proc/self/fd").iterdir()}


def test_every_tcp_connection_is_found_and_no_other_file_is_touched() -> None:
    connections = TcpConnections()
    connections.settle()
    local, remote = socket.socketpair()
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as client,
        server.accept()[0] as accepted,
        local,
        remote,
    ):
        for connection in (client, accepted):
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, TEN_SECONDS)
        before = files()
        ends = {"{}:{}".format(*connection.getpeername()) for connection in (client, accepted)}
        found = connections.settle()
        assert len(found) == 2
        assert set(found) == ends, "where they lead"
        assert connections.settle() == []
        assert files() == before, "nothing is left open"
        assert not any(map(lingers, (client, accepted)))
        client.sendall(b"still there")
        assert accepted.recv(20) == b"still there"
        local.send(b"x")
        assert remote.recv(1) == b"x"


def test_an_ipv6_connection_is_named_as_zenoh_does() -> None:
    with (
        socket.create_server(("::1", 0), family=socket.AF_INET6) as server,
        socket.create_connection(server.getsockname()[:2]) as client,
    ):
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, TEN_SECONDS)
        assert TcpConnections().settle() == [f"[::1]:{server.getsockname()[1]}"]


def test_what_is_settled_is_not_looked_at_again_but_whoever_has_its_number_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Hundreds may be there, and the process that looks drives a bus."""
    connections = TcpConnections()
    with socket.create_server(("127.0.0.1", 0)) as server:
        first = socket.create_connection(server.getsockname())
        first.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, TEN_SECONDS)
        number = first.fileno()
        assert len(connections.settle()) == 1
        looked_at: list[int] = []
        dup = os.dup
        monkeypatch.setattr(os, "dup", lambda number: looked_at.append(number) or dup(number))
        connections.settle()
        assert looked_at
        assert number not in looked_at
        first.close()
        with socket.create_connection(server.getsockname()) as second:
            assert second.fileno() == number
            second.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, TEN_SECONDS)
            assert len(connections.settle()) == 1
            assert not lingers(second)


def test_no_copy_is_left_whatever_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of the broadcast manager's socket would keep its bursts on the bus."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EOPNOTSUPP, "no address")

    with socket.socket(socket.AF_UNIX), socket.socket(socket.AF_INET):
        before = len(list(Path("/proc/self/fd").iterdir()))
        connections = TcpConnections()
        connections.settle()
        monkeypatch.setattr(socket, "socket", refuse)
        for _ in range(10):
            connections.settle()
        assert len(list(Path("/proc/self/fd").iterdir())) == before
