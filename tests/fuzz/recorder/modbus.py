"""Recorder of the requests of pymodbus and mbpoll."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Final

from pymodbus.client import ModbusTcpClient
from pymodbus.pdu.mei_message import ReadDeviceInformationRequest

from tests.fuzz.case import Case, Recorded, save
from tests.fuzz.recorder.proxy import Proxy, recording
from tests.fuzz.rig import Rig

_MBPOLL: Final = (
    ("reads holding registers", "-t 4:hex -r 0 -c 5 -1"),
    ("reads input registers", "-t 3:hex -r 0 -c 21 -1"),
    ("reads a float", "-t 3:float -r 32 -c 1 -1"),
    ("reads coils", "-t 0 -r 0 -c 16 -1"),
    ("reads discrete inputs", "-t 1 -r 0 -c 24 -1"),
)
_WRITES: Final = (
    ("writes control word and setpoint", "-t 4:hex -r 0", "0x047E 0"),
    ("releases", "-r 10", "0"),
)


def record(rig: Rig) -> list[Path]:
    with recording(rig.modbus) as proxy:
        by_pymodbus = _noted(proxy, _pymodbus(proxy.port))
    with recording(rig.modbus) as proxy:
        by_mbpoll = _noted(proxy, _mbpoll(proxy.port))
    return [
        save("modbus", "pymodbus", "each function that is served, as pymodbus asks for it", by_pymodbus),
        save("modbus", "mbpoll", "the calls of the README", by_mbpoll),
    ]


def _noted(proxy: Proxy, calls: list[tuple[str, Callable[[], object]]]) -> list[Recorded]:
    """Messages that each call sent."""
    recorded: list[Recorded] = []
    for what, call in calls:
        before = sum(len(link.sent) for link in proxy.links)
        call()
        frames = _frames(b"".join(link.sent for link in proxy.links)[before:])
        recorded += [Recorded(what, Case("stream", (frame,))) for frame in frames]
    return recorded


def _frames(stream: bytes) -> list[bytes]:
    frames: list[bytes] = []
    while len(stream) >= 7:
        end = 6 + int.from_bytes(stream[4:6], "big")
        frames.append(stream[:end])
        stream = stream[end:]
    return frames


def _pymodbus(port: int) -> list[tuple[str, Callable[[], object]]]:
    client = ModbusTcpClient("127.0.0.1", port=port)
    client.connect()
    return [
        ("function 1, coils", lambda: client.read_coils(0, count=16, device_id=1)),
        ("function 2, discrete inputs", lambda: client.read_discrete_inputs(0, count=24, device_id=1)),
        ("function 3, holding registers", lambda: client.read_holding_registers(0, count=5, device_id=1)),
        ("function 3, parameters", lambda: client.read_holding_registers(1000, count=16, device_id=4)),
        ("function 4, input registers", lambda: client.read_input_registers(0, count=25, device_id=1)),
        ("function 4, scaled values", lambda: client.read_input_registers(32, count=32, device_id=2)),
        ("function 4, the bridge", lambda: client.read_input_registers(0, count=13, device_id=255)),
        ("function 5, a coil", lambda: client.write_coil(0, True, device_id=1)),
        ("function 6, keep-alive", lambda: client.write_register(10, 1, device_id=1)),
        ("function 6, a stop", lambda: client.write_register(13, 1, device_id=4)),
        ("function 8, loopback", lambda: client.diag_query_data(b"\x12\x34", device_id=1)),
        ("function 15, coils", lambda: client.write_coils(0, [False, True, True, True], device_id=1)),
        ("function 16, a telegram", lambda: client.write_registers(0, [0x047E, 0x1000], device_id=4)),
        ("function 16, another drive's", lambda: client.write_registers(0, [0x047F, 0x2000], device_id=2)),
        ("function 16, a scaled setpoint", lambda: client.write_registers(32, [0x41C8, 0], device_id=4)),
        ("function 16, a parameter", lambda: client.write_registers(1000, [0x3F80, 0], device_id=4)),
        (
            "function 22, mask write",
            lambda: client.mask_write_register(address=0, and_mask=0xFFF2, or_mask=0x0025, device_id=1),
        ),
        (
            "function 23, write and read",
            lambda: client.readwrite_registers(
                read_address=0, read_count=5, write_address=0, values=[0x047E, 0], device_id=1
            ),
        ),
        *((f"function 43/14, code {code}", _identify(client, code)) for code in (1, 2, 3, 4)),
    ]


def _identify(client: ModbusTcpClient, code: int) -> Callable[[], object]:
    return lambda: client.execute(False, ReadDeviceInformationRequest(read_code=code, object_id=0, dev_id=1))


def _mbpoll(port: int) -> list[tuple[str, Callable[[], object]]]:
    def run(options: str, values: str = "") -> Callable[[], object]:
        command = ["mbpoll", "-q", "-p", str(port), "-0", *options.split(), "127.0.0.1", *values.split()]
        return lambda: subprocess.run(command, capture_output=True, check=False, timeout=20)

    return [(what, run(options)) for what, options in _MBPOLL] + [
        (what, run(options, values)) for what, options, values in _WRITES
    ]
