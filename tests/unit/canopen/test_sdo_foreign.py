"""canopen's SDO client and ours, side by side: the same requests, and the same made of each answer."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import canopen
import pytest
from canopen.sdo import SdoClient

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoChannel
from bridge.sim.core.dictionary import Dictionary, Domain
from bridge.sim.core.sdo_server import SimulatedSdoServer
from tests.support.sdo_block import INDEX, LONG, REPLY, REQUEST

Answer = Callable[[bytes], list[bytes]]
"""A server: its answers to a request."""


def by_canopen(answer: Answer) -> tuple[SdoClient, list[bytes]]:
    """Its client, and where its requests will be."""
    client = SdoClient(REQUEST, REPLY, canopen.ObjectDictionary())
    client.RESPONSE_TIMEOUT = 0.01
    asked: list[bytes] = []

    def send_message(can_id: int, data: bytes, remote: bool = False) -> None:
        assert (can_id, remote) == (REQUEST, False)
        asked.append(bytes(data))
        for reply in answer(bytes(data)):
            client.on_response(REPLY, reply, 0.0)

    client.network = SimpleNamespace(send_message=send_message)
    return client, asked


def by_us(answer: Answer, data: bytes | None = None) -> tuple[list[bytes], object]:
    """Our requests of a read (or a write of ``data``), and its result."""
    channel = SdoChannel(REQUEST, REPLY, 0.5, segment_s=0.0)
    asked: list[bytes] = []
    results: list[object] = []
    if data is None:
        channel.read(INDEX, 0, 0.0, results.append)
    else:
        channel.write(INDEX, 0, data, 0.0, results.append)
    while frames := channel.take_frames():
        for frame in frames:
            asked.append(frame.data)
            for reply in answer(frame.data):
                channel.on_frame(Frame(REPLY, reply, 0.0))
    (result,) = results
    return asked, result


class Store:
    """A server with one object."""

    def __init__(self, data: bytes = b"", segments: int = 0) -> None:
        self.data = data
        objects = Dictionary()
        objects.add(INDEX, 0, Domain(1 << 16, lambda: self.data, self._set))
        self.answer = SimulatedSdoServer(objects, segments).on_request

    def _set(self, data: bytes) -> None:
        self.data = data


@pytest.mark.parametrize("size", range(23))
def test_a_write_of_any_length_has_the_same_frames(size: int) -> None:
    theirs, ours = Store(), Store()
    client, expected = by_canopen(theirs.answer)
    client.download(INDEX, 0, LONG[:size])
    assert by_us(ours.answer, LONG[:size]) == (expected, b"")
    assert ours.data == theirs.data == LONG[:size]


@pytest.mark.parametrize("size", range(1, 23))
def test_a_read_of_any_length_has_the_same_frames(size: int) -> None:
    client, expected = by_canopen(Store(LONG[:size]).answer)
    assert client.upload(INDEX, 0) == LONG[:size]
    assert by_us(Store(LONG[:size]).answer) == (expected, LONG[:size])


@pytest.mark.parametrize("command", [command for command in range(0x40, 0x60) if command & 2])
def test_an_expedited_answer_has_as_many_bytes(command: int) -> None:
    """CiA 301 §7.2.4.3.6: four without a length (s = 0), whatever the bits of n are."""

    def answer(request: bytes) -> list[bytes]:
        return [bytes((command,)) + request[1:4] + b"\x11\x22\x33\x44"]

    client, expected = by_canopen(answer)
    value = client.upload(INDEX, 0)
    assert by_us(answer) == (expected, value)


@pytest.mark.parametrize("unused", range(8))
@pytest.mark.parametrize("initiated", ["40 20 1F 00 00 00 00 00", "50 20 1F 00 FF FF FF FF"])
def test_a_segment_has_as_many_bytes(initiated: str, unused: int) -> None:
    """§7.2.4.3.7. Where no length is announced (s = 0, §7.2.4.3.6), the bytes for it say nothing."""
    segments = {
        0x40: bytes.fromhex(initiated),
        0x60: bytes.fromhex("00 11 22 33 44 55 66 77"),
        0x70: bytes((0x11 | unused << 1,)) + bytes.fromhex("88 99 AA BB CC DD EE"),
    }

    def answer(request: bytes) -> list[bytes]:
        return [segments[request[0]]]

    client, expected = by_canopen(answer)
    value = client.upload(INDEX, 0)
    assert by_us(answer) == (expected, value)


def without_crc(answer: Answer) -> Answer:
    """A server without CRC: sc is 0 in its answers (§7.2.4.3.9, §7.2.4.3.13), and it looks at none."""

    def plain(request: bytes) -> list[bytes]:
        if request[0] in (0xC6, 0xA4):
            return [
                bytes((reply[0] & ~4,)) + reply[1:]
                for reply in answer(bytes((request[0] & ~4,)) + request[1:])
            ]
        return answer(request)

    return plain


def as_it_is(answer: Answer) -> Answer:
    return answer


@pytest.mark.parametrize("server", [as_it_is, without_crc])
@pytest.mark.parametrize("segments", [1, 2, 126, 127])
@pytest.mark.parametrize("size", [112, 116, 889, 890, 1024])
def test_a_block_download_has_the_same_frames(
    size: int, segments: int, server: Callable[[Answer], Answer]
) -> None:
    theirs, ours = Store(segments=segments), Store(segments=segments)
    client, expected = by_canopen(server(theirs.answer))
    with client.open(INDEX, 0, "wb", size=size, block_transfer=True) as file:
        file.write(LONG[:size])
    assert by_us(server(ours.answer), LONG[:size]) == (expected, b"")
    assert ours.data == theirs.data == LONG[:size]


@pytest.mark.parametrize("server", [as_it_is, without_crc])
@pytest.mark.parametrize("size", [112, 116, 889, 890, 1024])
def test_a_block_upload_has_the_same_frames(size: int, server: Callable[[Answer], Answer]) -> None:
    """Ours come after an ordinary initiation, which tells how long the object is, and its abort."""
    client, expected = by_canopen(server(Store(LONG[:size], 127).answer))
    with client.open(INDEX, 0, "rb", block_transfer=True) as file:
        assert file.read() == LONG[:size]
    asked, value = by_us(server(Store(LONG[:size], 127).answer))
    assert (asked[2:], value) == (expected, LONG[:size])
    assert [request.hex(" ") for request in asked[:2]] == [
        "40 20 1f 00 00 00 00 00",
        "80 20 1f 00 00 00 00 08",
    ]
