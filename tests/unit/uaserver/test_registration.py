"""Registration with a discovery server that is not there; with one, it is in ``tests/wire/opcua``."""

from __future__ import annotations

import asyncio
import logging

import pytest

from bridge.uaserver.registration import RegisteredServer, Registration
from tests.support.process import free_port

SERVER = RegisteredServer("urn:hall:drivebridge", "urn:drivebridge", "hall", "opc.tcp://hall:4840", b"", b"")


async def test_what_fails_is_told_and_tried_again_a_minute_later(caplog: pytest.LogCaptureFixture) -> None:
    pauses: list[float] = []

    async def sleep(pause_s: float) -> None:
        pauses.append(pause_s)
        if len(pauses) == 2:
            raise asyncio.CancelledError

    url = f"opc.tcp://127.0.0.1:{free_port()}"
    registration = Registration(url, SERVER, sleep)
    with caplog.at_level(logging.WARNING), pytest.raises(asyncio.CancelledError):
        await registration.run()
    assert pauses == [60.0, 60.0]
    assert all(f"not registered at {url}" in message for message in caplog.messages)
    caplog.clear()
    # Nobody is told of an end who was never told of a beginning.
    await registration.end()
    assert caplog.messages == []
