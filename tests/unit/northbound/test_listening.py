"""Listening sockets: advice where none can be had, clients that are turned away for want of descriptors."""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Iterator

import pytest

from bridge.base.errors import OperationFailed, Unavailable
from bridge.northbound import listening
from bridge.northbound.listening import ListeningSocket, Port, is_listening, listen, until_deaf


@pytest.fixture
def bound() -> Iterator[ListeningSocket]:
    bound = listen("127.0.0.1:0", "modbus.listen")
    yield bound
    bound.close()


def port_of(bound: socket.socket) -> int:
    return bound.getsockname()[1]


def test_a_port_that_is_taken_is_told_with_what_helps(bound: ListeningSocket) -> None:
    endpoint = f"127.0.0.1:{port_of(bound)}"
    with pytest.raises(Unavailable) as caught:
        listen(endpoint, "modbus.listen")
    assert str(caught.value) == (
        f"modbus.listen = '{endpoint}': port {port_of(bound)} is taken by another program; "
        "`ss -ltnp` shows which, or choose another port"
    )


def test_an_address_that_no_interface_has_is_named() -> None:
    with pytest.raises(Unavailable, match=r"no interface of this machine has the address 192\.0\.2\.1"):
        listen("192.0.2.1:0", "modbus.listen")


def test_a_port_that_needs_a_right_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*place: object, **more: object) -> None:
        raise OSError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(socket, "create_server", refuse)
    with pytest.raises(Unavailable, match="port 502 needs CAP_NET_BIND_SERVICE"):
        listen("0.0.0.0:502", "modbus.listen")


def test_an_ipv6_address_stands_in_brackets() -> None:
    if not socket.has_ipv6:
        pytest.skip("this machine has no IPv6")
    with listen("[::1]:0", "opcua.listen") as bound:
        assert bound.family is socket.AF_INET6
        assert is_listening(bound)


def test_a_socket_that_was_closed_listens_no_more(bound: ListeningSocket) -> None:
    assert is_listening(bound)
    bound.close()
    assert not is_listening(bound)


async def test_who_waits_for_its_end_is_told_by_its_key(bound: ListeningSocket) -> None:
    bound.close()
    with pytest.raises(OperationFailed, match=r"modbus\.listen: its socket listens no more"):
        await until_deaf(bound, "modbus.listen")


class Exhausted:
    """A process that has no descriptor left: accepting fails until one is closed."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, for_good: bool = False) -> None:
        self.left, self.for_good = 0, for_good
        accept, close, opened = socket.socket.accept, os.close, os.open

        def accepting(one: socket.socket) -> object:
            if not self.left:
                raise OSError(errno.EMFILE, "Too many open files")
            return accept(one)

        def closing(descriptor: int) -> None:
            close(descriptor)
            self.left += not self.for_good

        def opening(*place: object) -> int:
            if self.for_good:
                raise OSError(errno.EMFILE, "Too many open files")
            self.left = 0
            return opened(*place)  # type: ignore[arg-type]

        monkeypatch.setattr(socket.socket, "accept", accepting)
        monkeypatch.setattr(listening.os, "close", closing)
        monkeypatch.setattr(listening.os, "open", opening)


def test_who_connects_while_no_descriptor_is_left_is_turned_away(
    bound: ListeningSocket, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with socket.create_connection(bound.getsockname()) as client:
        with monkeypatch.context() as patch:
            Exhausted(patch)
            with pytest.raises(BlockingIOError):
                bound.accept()
        client.settimeout(5)
        assert client.recv(10) == b""
    assert caplog.messages == ["modbus.listen: no client can connect: Too many open files"]


def test_where_even_that_fails_it_is_an_error_once_and_then_nothing_is_there(
    bound: ListeningSocket, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        Exhausted(patch, for_good=True)
        with pytest.raises(OSError, match="Too many open files") as caught:
            bound.accept()
        assert caught.value.errno == errno.EMFILE
        with pytest.raises(BlockingIOError):
            bound.accept()


async def test_a_held_port_is_opened_anew_where_its_socket_has_ended() -> None:
    port = Port("127.0.0.1:0", "modbus.listen")
    await port.open()
    first = port.socket()
    assert port.socket() is first
    first.close()
    second = port.socket()
    assert second is not first
    assert is_listening(second)
    port.close()
    port.close()
    assert not is_listening(second)
