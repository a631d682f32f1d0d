"""Names and addresses by which clients reach the server."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from bridge.northbound.opcua.certificates.ownnames import names_of, own_addresses


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the machine, the last one now."""
    names = ["hall-3"]
    monkeypatch.setattr(socket, "gethostname", lambda: names[-1])
    return names


TRIE = """\
Main:
  +-- 0.0.0.0/0 3 0 5
     +-- 127.0.0.0/8 2 0 2
        |-- 127.0.0.1
           /32 host LOCAL
     +-- 192.168.10.0/24 2 0 2
        |-- 192.168.10.0
           /24 link UNICAST
        |-- 192.168.10.1
           /32 host LOCAL
        |-- 192.168.10.255
           /32 link BROADCAST
Local:
        |-- 192.168.10.1
           /32 host LOCAL
"""


INET6 = """\
fe8000000000000000fc00fffe000001 04 40 20 80     eth0
fd000000000000000000000000000002 04 40 00 82     eth0
"""


def test_the_machine_s_addresses_are_those_of_its_interfaces(tmp_path: Path) -> None:
    trie, inet6 = tmp_path / "fib_trie", tmp_path / "if_inet6"
    trie.write_text(TRIE)
    inet6.write_text(INET6)
    assert list(own_addresses(trie, inet6)) == ["127.0.0.1", "192.168.10.1", "fd00::2"]
    assert list(own_addresses(trie, tmp_path / "none")) == ["127.0.0.1", "192.168.10.1"]


def test_this_machine_s_own_are_found() -> None:
    assert "127.0.0.1" in list(own_addresses())


@pytest.mark.parametrize("listen", ["0.0.0.0:4840", "[::]:4840"])
def test_a_server_on_all_interfaces_is_known_by_all_addresses(listen: str, host: list[str]) -> None:
    names = names_of(listen, ["bridge.example", "10.1.1.1"])
    assert names[:2] == ["bridge.example", "10.1.1.1"]
    assert {"hall-3", "localhost", *own_addresses()} <= set(names)
    assert not any(name in ("0.0.0.0", "::") for name in names)


def test_a_server_on_one_address_is_known_by_that(host: list[str]) -> None:
    assert names_of("192.168.10.1:4840", []) == ["hall-3", "192.168.10.1", "localhost", "127.0.0.1"]
