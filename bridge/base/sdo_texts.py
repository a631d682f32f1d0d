"""Texts for failed SDO transfers: ``canopen`` has them in English only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from bridge.canopen import abort
from bridge.canopen.decode_sdo import SdoSaid, shown
from bridge.canopen.sdo_block import Learned
from bridge.canopen.sdo_transfer import SdoError
from bridge.text import Text

_ABORTS: Final[Mapping[int, Text]] = {
    0x0503_0000: Text.of("abort.toggle"),
    0x0504_0000: Text.of("abort.timed_out"),
    0x0504_0001: Text.of("abort.unknown_command"),
    0x0504_0002: Text.of("abort.block_size"),
    0x0504_0003: Text.of("abort.sequence"),
    0x0504_0004: Text.of("abort.crc"),
    0x0504_0005: Text.of("abort.out_of_memory"),
    0x0601_0000: Text.of("abort.unsupported_access"),
    0x0601_0001: Text.of("abort.write_only"),
    0x0601_0002: Text.of("abort.read_only"),
    0x0602_0000: Text.of("abort.no_object"),
    0x0604_0041: Text.of("abort.not_mappable"),
    0x0604_0042: Text.of("abort.pdo_length"),
    0x0604_0043: Text.of("abort.parameter_incompatible"),
    0x0604_0047: Text.of("abort.device_incompatible"),
    0x0606_0000: Text.of("abort.hardware"),
    0x0607_0010: Text.of("abort.length"),
    0x0607_0012: Text.of("abort.length_too_high"),
    0x0607_0013: Text.of("abort.length_too_low"),
    0x0609_0011: Text.of("abort.no_sub"),
    0x0609_0030: Text.of("abort.value"),
    0x0609_0031: Text.of("abort.value_too_high"),
    0x0609_0032: Text.of("abort.value_too_low"),
    0x0609_0036: Text.of("abort.limits"),
    0x060A_0023: Text.of("abort.no_resource"),
    0x0800_0000: Text.of("abort.general"),
    0x0800_0020: Text.of("abort.not_stored"),
    0x0800_0021: Text.of("abort.local_control"),
    0x0800_0022: Text.of("abort.device_state"),
    0x0800_0023: Text.of("abort.no_dictionary"),
    0x0800_0024: Text.of("abort.no_data"),
}
_UNKNOWN: Final = Text.of("abort.unknown")
_WAYS: Final[Mapping[str, Text]] = {
    "refused": Text.of("sdo_way.refused"),
    "no_answer": Text.of("sdo_way.no_answer"),
    "segments": Text.of("sdo_way.segments"),
    "aborted": Text.of("sdo_way.aborted"),
    "silent": Text.of("sdo_way.silent"),
    "out_of_step": Text.of("sdo_way.out_of_step"),
    "aborted_at_end": Text.of("sdo_way.aborted_at_end"),
    "silent_at_end": Text.of("sdo_way.silent_at_end"),
    "crc": Text.of("sdo_way.crc"),
    "length": Text.of("sdo_way.length"),
    "end_refused": Text.of("sdo_way.end_refused"),
}

_REQUESTS: Final[Mapping[str, Callable[[str, int], Text]]] = {
    "length": lambda _, count: Text.of("sdo_request.length", count=count),
    "unknown": lambda _, command: Text.of("sdo_request.unknown", command=command),
    "abort": lambda name, code: Text.of("sdo_request.abort", object=name, why=text_of_abort(code), code=code),
    "read": lambda name, _: Text.of("sdo_request.read", object=name),
    "read_on": lambda name, _: Text.of("sdo_request.read_on", object=name),
    "write_long": lambda name, count: Text.of("sdo_request.write_bytes", object=name, count=count),
    "segment": lambda name, _: Text.of("sdo_request.segment", object=name),
    "block_read": lambda name, _: Text.of("sdo_request.block_read", object=name),
    "block_read_start": lambda name, _: Text.of("sdo_request.block_read_start", object=name),
    "block_read_end": lambda name, _: Text.of("sdo_request.block_read_end", object=name),
    "taken": lambda name, number: Text.of("sdo_request.taken", object=name, number=number),
    "block_write": lambda name, _: Text.of("sdo_request.block_write", object=name),
    "block_write_end": lambda name, _: Text.of("sdo_request.block_write_end", object=name),
    "block_segment": lambda name, number: Text.of("sdo_request.block_segment", object=name, number=number),
    "last_block_segment": lambda name, sub: Text.of("sdo_request.last_segment", object=name, number=sub),
}


def text_of_abort(code: int) -> Text:
    """The meaning of an abort code (CiA 301 §7.2.4.3.17)."""
    return _ABORTS.get(code, _UNKNOWN)


def text_of_request(said: SdoSaid) -> Text:
    """A request of a client to a server."""
    about = dict(said.values)
    name = f"{about.get('index', '')}h:{about.get('sub', 0):02X}"
    if said.act in ("write", "value"):
        data = bytes.fromhex(str(about["data"]))
        value = shown(data) if data else Text.of("sdo_request.nothing")
        is_begin = said.act == "write"
        return Text.of("sdo_request.write" if is_begin else "sdo_request.value", object=name, value=value)
    if said.act == "write_long" and said.number is None:
        return Text.of("sdo_request.write_segments", object=name)
    return _REQUESTS[said.act](name, said.number or 0)


def text_of(error: SdoError) -> Text:
    """The object, who has ended its transfer, and why."""
    name, why, code = f"{error.index:04X}h:{error.sub:02X}", text_of_abort(error.code), error.code
    if error.by_server:
        return Text.of("sdo.aborted", object=name, why=why, code=code)
    if code == abort.BUSY:
        return Text.of("sdo.not_asked", object=name, why=why, code=code)
    return Text.of("sdo.no_answer", object=name, why=why, code=code)


def text_of_learned(learned: Learned) -> Text:
    """The way in which block transfer breaks, and the error that showed it."""
    return Text.of("sdo_way.shown", way=_WAYS[learned.way.name], why=text_of(learned.failure))
