"""Messages of one connection; no server."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua.common.connection import TransportLimits

from bridge.uaserver.connections.transport import Processor


def test_the_log_names_the_network_of_a_client_that_has_all_its_addresses(
    caplog: pytest.LogCaptureFixture,
) -> None:
    for host in ("2001:db8:1:2::7", "2001:db8:1:2:3:4:5:6"):
        peer = {"peername": (host, 50000, 0, 0)}
        transport: Any = SimpleNamespace(get_extra_info=peer.get)
        server: Any = None
        Processor(server, transport, TransportLimits())._fault(KeyError("x"))
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 2
    assert all("from 2001:db8:1:2::/64: " in line for line in told), told
