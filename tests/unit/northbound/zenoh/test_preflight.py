"""Ports of the zenoh server, looked at before a bus is opened: those that are taken are named."""

from __future__ import annotations

import socket

import pytest

from bridge.base.errors import Unavailable
from bridge.config import ZenohTable
from bridge.northbound.zenoh.preflight import check_ports


def settings(*endpoints: str, mode: str = "peer") -> ZenohTable:
    return ZenohTable.model_construct(mode=mode, listen=list(endpoints))


@pytest.mark.parametrize("kind", ["tcp", "tls"])
async def test_a_port_that_is_taken_is_told_with_its_key(kind: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        place = f"127.0.0.1:{taken.getsockname()[1]}"
        for endpoint in (f"{kind}/{place}", f"{kind}/{place}?rel=1", f"{kind}/{place}#iface=lo"):
            with pytest.raises(Unavailable, match=rf"zenoh\.listen = '{place}': port \d+ is taken"):
                await check_ports(settings(endpoint))
        await check_ports(settings(f"{kind}/{place}", mode="client"))


async def test_one_that_is_free_is_left_free() -> None:
    with socket.create_server(("127.0.0.1", 0)) as one:
        port = one.getsockname()[1]
    await check_ports(settings(f"tcp/127.0.0.1:{port}"))
    with socket.create_server(("127.0.0.1", port)):
        pass


async def test_endpoints_that_are_no_sockets_of_tcp_are_zenohs_own_affair() -> None:
    await check_ports(settings("udp/127.0.0.1:1", "unixsock-stream//run/x", "tcp/no-port"))
