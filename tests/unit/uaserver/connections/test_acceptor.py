"""Connections to a listening server, by bytes; the application is the test's."""

from __future__ import annotations

import asyncio
import struct
from contextlib import suppress

import pytest
from asyncua import ua

from tests.support.opcua_application import Served
from tests.unit.uaserver.test_bound import serving

LIMIT_S = 20.0


async def answer(url: str, content: bytes) -> bytes:
    """All that the server says until it closes the connection."""
    host, _, port = url.removeprefix("opc.tcp://").rpartition(":")
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(content)
    told = b""
    # Where the server has not read everything, its end is a reset.
    with suppress(ConnectionResetError):
        async with asyncio.timeout(LIMIT_S):
            told = await reader.read()
    writer.close()
    return told


def error_of(told: bytes) -> int:
    assert told[:4] == b"ERRF", told
    (code,) = struct.unpack_from("<I", told, 8)
    return code


@pytest.mark.landing
async def test_noise_ends_a_connection_and_is_counted_once() -> None:
    application = Served()
    async with serving(application) as url:
        await answer(url, b"GET / HTTP/1.1\r\n\r\n")
        assert application.broken == 1


@pytest.mark.landing
async def test_a_hello_that_takes_no_answer_is_refused() -> None:
    application = Served()
    where = b"opc.tcp://x"
    sizes = struct.pack("<5I", 0, 1024, 1024, 1024, 1)
    body = sizes + struct.pack("<i", len(where)) + where
    async with serving(application) as url:
        told = await answer(url, b"HELF" + struct.pack("<I", 8 + len(body)) + body)
    assert error_of(told[told.index(b"ERRF") :]) == ua.StatusCodes.BadConnectionRejected
    assert (application.refusals, application.broken) == (1, 0)


@pytest.mark.landing
async def test_a_chunk_beyond_the_limit_is_not_waited_for() -> None:
    application = Served()
    async with serving(application) as url:
        await answer(url, b"MSGF" + struct.pack("<I", 0x7FFF_FFFF) + bytes(200_000))
        assert application.broken == 1
