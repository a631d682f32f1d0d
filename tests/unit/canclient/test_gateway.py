"""A client of the ASCII gateway: answers by their sequence, errors with codes, a bridge that goes away."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bridge.canclient.gateway import GatewayClient, GatewayError


class Gateway:
    """Answers each line by what ``answers`` makes of sequence and command."""

    def __init__(self, path: Path) -> None:
        self.answers: Callable[[str, str], str] = lambda begin, command: f"{begin} OK\r\n"
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.bind(str(path))
        self._server.listen()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        client, _ = self._server.accept()
        with client, client.makefile("rb") as lines:
            for line in lines:
                begin, _, command = line.decode().strip().partition(" ")
                answer = self.answers(begin, command)
                if not answer:
                    return
                client.sendall(answer.encode())

    def close(self) -> None:
        self._server.close()
        self._thread.join(5)


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    gateway = Gateway(tmp_path / "gate")
    yield gateway
    gateway.close()


@pytest.fixture
def client(gateway: Gateway, tmp_path: Path) -> Iterator[GatewayClient]:
    client = GatewayClient(tmp_path / "gate")
    yield client
    client.close()


def test_an_answer_is_what_stands_behind_its_sequence(gateway: Gateway, client: GatewayClient) -> None:
    asked: list[str] = []

    def answer(begin: str, command: str) -> str:
        asked.append(command)
        return f"[99] another's\r\nNOTICE\r\n{begin} 0x1234\r\n"

    gateway.answers = answer
    assert client.ask("5 read 0x1000 0 u32") == "0x1234"
    assert asked == ["5 read 0x1000 0 u32"]


@pytest.mark.parametrize(
    ("answer", "code", "text"),
    [
        ("ERROR:0x06020000 # no object", 0x0602_0000, "no object (06020000h)"),
        ("ERROR:101", 101, "error 101"),
        ("ERROR:101 # syntax", 101, "syntax (error 101)"),
    ],
)
def test_an_error_has_its_code_and_its_reason(
    gateway: Gateway, client: GatewayClient, answer: str, code: int, text: str
) -> None:
    """CiA 309-3: below 1000h the gateway's own codes, above them those of SDO."""
    gateway.answers = lambda begin, command: f"{begin} {answer}\r\n"
    with pytest.raises(GatewayError) as caught:
        client.ask("x")
    assert (caught.value.code, str(caught.value)) == (code, text)


def test_a_bridge_that_goes_away_is_told(gateway: Gateway, client: GatewayClient) -> None:
    gateway.answers = lambda begin, command: ""
    with pytest.raises(ConnectionError, match="the bridge has closed the connection"):
        client.ask("x")


def test_where_no_bridge_is_there_is_no_client(tmp_path: Path) -> None:
    with pytest.raises(OSError):
        GatewayClient(tmp_path / "none")
