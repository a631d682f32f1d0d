"""Codecs and parsers of strangers' bytes, each as a function that takes any bytes.

What a parser says of bytes that are none of its own is part of it; whatever else it raises is a finding.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from struct import Struct
from typing import Final, NamedTuple

import msgspec
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary

from bridge.base.errors import FileFaults, OperationFailed
from bridge.bustools.decode import Decoder
from bridge.can import errorframe, netlink
from bridge.can.interface import BusStatus
from bridge.canopen.frame import EXTENDED, REMOTE, STANDARD_MASK, Frame
from bridge.cli.trace import SUFFIXES, Trace
from bridge.command import Event
from bridge.config import load_site
from bridge.eds import read_device
from bridge.mapping.loader import family_of, mappings_dir
from bridge.mirror import protocol
from bridge.mirror.protocol import Answered, Connected, Malformed, Rejected
from bridge.northbound.gateway import cia309_types, syntax
from bridge.northbound.modbus.connection import Conversation
from bridge.northbound.zenoh.commands import BadCommand, Commands, identity_of
from bridge.project import Project, load_project
from bridge.recorder.checkpoint import load as load_checkpoint
from bridge.recorder.checkpoint import save as save_checkpoint
from bridge.recorder.core_names import Unusable
from bridge.recorder.recording import (
    MAGIC,
    SUFFIX,
    Header,
    Segment,
    State,
    header_chunk,
    read,
    state_chunk,
    turns_chunk,
)
from bridge.recorder.replay import PlayedBus, PlayingTape
from bridge.recorder.tape import facts_of
from bridge.recorder.told import frames_of as frames_of_recording
from bridge.recorder.told import lines_of
from bridge.text import LANGUAGES, Text, render
from bridge.uaserver import decoding
from bridge.witness.description import Unreadable, describe
from tests.fuzz.case import load
from tests.support.modbus_site import PLC, READY, Rig, make_plant
from tests.support.process import REPOSITORY
from tests.support.quick import Quick, quick_site

_FRAME: Final = Struct("<IBB8s")
"""Identifier with its flags, length, how long after the one before (10 ms), data."""
_LENGTHS: Final = 9
_MOST_FRAMES: Final = 40
_DEMO: Final = REPOSITORY / "bridge" / "demo" / "site.toml"
_NODES: Final = ("", 'supervision = "guarding"')
_HEADER: Final = Header(version="1", site="x", buses=("can0",), number=1, began=0.0, epoch_ns=0)
_NO_BUS: Final = PlayedBus("can0", PlayingTape(), facts_of(BusStatus()))
_PARTS: Final = b"\0\0"
"""Between the parts of what has several."""


class Parser(NamedTuple):
    """``feed`` takes any bytes; ``seeds`` has some that are sound."""

    feed: Callable[[bytes], None]
    seeds: Callable[[], Iterable[bytes]]


# CAN


def frames_of(data: bytes) -> Iterator[tuple[float, Frame]]:
    """Frames with the seconds that pass before each."""
    for place in range(0, min(len(data), _MOST_FRAMES * _FRAME.size) - _FRAME.size + 1, _FRAME.size):
        can_id, length, after, content = _FRAME.unpack_from(data, place)
        can_id &= STANDARD_MASK | EXTENDED | REMOTE
        yield after / 100, Frame(can_id, content[: length % _LENGTHS])


def bytes_of(frames: Iterable[Frame]) -> bytes:
    """The same frames, one 10 ms after the other."""
    return b"".join(
        _FRAME.pack(frame.can_id, len(frame.data), 1, frame.data.ljust(8, b"\0")) for frame in frames
    )


@cache
def _quick_site() -> object:
    with tempfile.TemporaryDirectory() as folder:
        return quick_site(Path(folder), _NODES)


def master(data: bytes) -> None:
    """A bus with two nodes, from their boot-up on."""
    quick = Quick(_quick_site())  # type: ignore[arg-type]
    quick.run(0.3)
    for after, frame in frames_of(data):
        quick.run(after)
        quick.receive(frame)
        quick.round()
    quick.run(1.0)


@cache
def _demo() -> Project:
    return load_project(_DEMO)


def monitor(data: bytes) -> None:
    """The words of ``drivebridge monitor``."""
    project = _demo()
    decoder = Decoder(project.site.bus[0].node, project.families, 127)
    for _, frame in frames_of(data):
        decoder.decode(frame)


def _recorded_frames() -> Iterator[bytes]:
    for case in load("can").of("frames"):
        heads = [(int.from_bytes(part[:4], "big"), part[4:12]) for part in case.parts]
        yield bytes_of(Frame(can_id, content) for can_id, content in heads)


def kernel(data: bytes) -> None:
    """Error frames, and the kernel's answers about an interface."""
    with suppress(OSError):
        netlink.parse(data)
    content = data[4:12].ljust(8, b"\0")
    can_id = int.from_bytes(data[:4], "little") & 0x1FFF_FFFF
    errorframe.judge(can_id, content)
    for language in LANGUAGES:
        render(errorframe.describe(can_id, content), language)


def trace(data: bytes) -> None:
    """A recorded trace; the first byte says of which kind."""
    suffix = SUFFIXES[data[0] % len(SUFFIXES)] if data else ".log"
    with tempfile.NamedTemporaryFile(suffix=suffix) as file:
        file.write(data[1:])
        file.flush()
        with suppress(OperationFailed):
            for _ in Trace(Path(file.name), None, None).frames():
                pass


def _traces() -> Iterator[bytes]:
    yield b"\0(1700000000.000000) can0 205#7F04000000000000\n(1700000000.100000) can0 705#05\n"
    yield (
        b"\1date Sat Nov 28 22:00:00.000 2026\nbase hex  timestamps absolute\n"
        b"   0.100000 1  205             Rx   d 8 7F 04 00 00 00 00 00 00\n"
    )
    yield (
        b"\2;$FILEVERSION=2.1\n;$STARTTIME=45000.5\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n"
        b"      1         1.000 DT  1 0205 Rx -  8    7F 04 00 00 00 00 00 00\n"
    )
    yield b"\3LOGG" + bytes(140)


# files


def device_file(data: bytes) -> None:
    with suppress(FileFaults):
        read_device(data, "x.eds")


def witness_file(data: bytes) -> None:
    with suppress(Unreadable):
        describe(data, 5)


def _device_files() -> Iterator[bytes]:
    for name in ("encoder", "io16"):
        yield (REPOSITORY / "tests" / "devices" / f"{name}.eds").read_bytes()
    yield b'<?xml version="1.0"?><ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1"/>'


def site_file(data: bytes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".toml") as file:
        file.write(data)
        file.flush()
        with suppress(FileFaults):
            load_site(Path(file.name))


def mapping_file(data: bytes) -> None:
    with suppress(FileFaults):
        family_of(data.decode("utf-8", "replace"), mappings_dir() / "own.toml")


def recording(data: bytes) -> None:
    """A recording; the first byte says of what the rest is: the file, a turn, or a checkpoint."""
    kind, content = data[0] % 3 if data else 0, data[1:]
    with suppress(OperationFailed, Unusable):
        match kind:
            case 0:
                with tempfile.NamedTemporaryFile(suffix=SUFFIX) as file:
                    file.write(content)
                    file.flush()
                    _tell(read(Path(file.name)))
            case 1:
                _tell([Segment(_HEADER, None, [content])])
            case _:
                tape = PlayingTape()
                core = load_checkpoint(content, tape, lambda name: _NO_BUS, tape.alarm)
                del core


def _tell(segments: list[Segment]) -> None:
    for told in lines_of(segments), frames_of_recording(segments):
        for _ in told:
            pass


def _recordings() -> Iterator[bytes]:
    turn = msgspec.msgpack.encode(
        ["take_in", [], 1.0, ["frames", "can0", [[0x185, b"\0" * 8, 0.5]]], ["send", "can0", 0, b"\1\5"]]
    )
    whole = header_chunk(_HEADER) + state_chunk(State("", 0, {}, b"")) + turns_chunk([turn])
    yield b"\0" + MAGIC + whole
    yield b"\1" + turn
    yield b"\2" + save_checkpoint([Text.of("bus.is_down"), Struct("<H"), {1: (2.0, "x")}])


# clients


def modbus(data: bytes) -> None:
    rig = Rig()
    rig.runs(READY)

    def handle(unit: int, pdu: bytes, answer: Callable[[bytes], None], received_at: float) -> None:
        rig.dispatcher.handle(unit, pdu, PLC, answer)

    conversation = Conversation(handle, lambda: None)
    conversation.receive(data)
    conversation.advance(16)
    while conversation.backlog:
        conversation.advance(16)


def opcua(data: bytes) -> None:
    """The body of a request, as far as the decoder goes."""
    decoding.install()
    decoding.begin(decoding.MOST_ELEMENTS)
    body = Buffer(data)
    try:
        kind = nodeid_from_binary(body)
        struct_from_binary(ua.RequestHeader, body)
        request = ua.extension_objects_by_typeid.get(kind)
        if request is not None and hasattr(request(), "Parameters"):
            struct_from_binary(type(request().Parameters), body)
    except Exception as error:
        if not decoding.is_malformed(error):
            raise


@cache
def _commands() -> Commands:
    return Commands(make_plant().image.points)


def zenoh(data: bytes) -> None:
    """Key, payload and attachment of a query."""
    key, payload, attachment = (*data.split(_PARTS, 2), b"", b"")[:3]
    with suppress(BadCommand):
        _commands().request(key.decode("utf-8", "replace"), payload, identity_of(attachment))


def gateway(data: bytes) -> None:
    """A line of CiA 309-3, and a value of each of its types."""
    with suppress(syntax.BadLine):
        _, rest = syntax.split_sequence(data.decode("utf-8", "replace"))
        line = syntax.parse(rest)
        if isinstance(line.command, syntax.GatewayRead):
            cia309_types.decode(line.command.kind, data)


_DECODERS: Final[tuple[Callable[[bytes], object], ...]] = (
    protocol.decode_snapshot,
    partial(protocol.decode_delta, count=10),
    partial(protocol.decode_prompt, count=10),
    protocol.decode_request,
    protocol.decode_counted,
    partial(protocol.decode, Event),
    partial(protocol.decode, Answered),
    partial(protocol.decode, Connected),
    partial(protocol.decode, Rejected),
)


def mirror(data: bytes) -> None:
    """A message between the processes of the service."""
    for decode in _DECODERS:
        with suppress(Malformed):
            decode(data)


def _parts(protocol_name: str, kind: str, between: bytes = b"") -> Callable[[], Iterable[bytes]]:
    return lambda: (between.join(case.parts) for case in load(protocol_name).of(kind))


def _queries() -> Iterator[bytes]:
    for case in load("zenoh").of("get"):
        key = case.parts[0].partition(b"/")[2].partition(b"/")[2]
        yield _PARTS.join((key, *case.parts[2:4]))


PARSERS: Final = {
    "master": Parser(master, _recorded_frames),
    "monitor": Parser(monitor, _recorded_frames),
    "kernel": Parser(kernel, lambda: (b"\x04\0\0\0\0\x04\0\0\0\0\x60\x80",)),
    "trace": Parser(trace, _traces),
    "device-file": Parser(device_file, _device_files),
    "witness-file": Parser(witness_file, _device_files),
    "site-file": Parser(site_file, lambda: (_DEMO.read_bytes(),)),
    "mapping-file": Parser(mapping_file, lambda: ((mappings_dir() / "nord/sk-tu3-cao.toml").read_bytes(),)),
    "recording": Parser(recording, _recordings),
    "modbus": Parser(modbus, _parts("modbus", "stream")),
    "opcua": Parser(opcua, _parts("opcua", "service")),
    "zenoh": Parser(zenoh, _queries),
    "gateway": Parser(
        gateway, lambda: (b"[1] 1 5 read 0x1018 1 u32", b'[2] write 0x1008 0 vs "x"', b"[3] start")
    ),
    "mirror": Parser(mirror, lambda: (b"\x93\x01\x02\x90",)),
}
