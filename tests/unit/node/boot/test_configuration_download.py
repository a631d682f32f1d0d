"""Configuration of a node at boot-up: written where it differs, read back, and by date not at all."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoError
from bridge.config.download import Download
from bridge.image import Quality
from bridge.node.boot.actions import BootResult, BootStep, SdoRead, SdoWrite
from bridge.node.boot.configuration_download import configuration_stamp, configure
from bridge.node.boot.error_status import BootError
from bridge.text import render
from tests.support.bench import Bench, write_site

REQUEST = 0x605
START = Frame(0, b"\x01\x05")


def booted(tmp_path: Path, *, node: str = "", drive: str = "", bus: str = "") -> Bench:
    bench = Bench(write_site(tmp_path, node=node, drive=drive, bus=bus))
    bench.run(1.5)
    return bench


def status(bench: Bench) -> str:
    return str(bench.value("conveyor/node/boot_status"))


def written(bench: Bench) -> list[bytes]:
    """Every expedited write to the node, in order: index, sub-index, bytes."""
    return [frame.data for frame in bench.sent(REQUEST) if frame.data[0] & 0xE3 == 0x23]


def was_started(bench: Bench) -> bool:
    return START in [frame._replace(time=0.0) for frame in bench.log]


P151 = """
[[bus.node.configure]]
object = "2097:01"
type = "uint16"
value = 500
"""
P151_IS_500 = bytes.fromhex("2B972001F4010000")


@pytest.mark.landing
def test_the_configuration_is_written_once_and_read_back(tmp_path: Path) -> None:
    """BU 2500 §7.1.1: P151 is 2097h:1."""
    bench = booted(tmp_path, node=P151)
    assert P151_IS_500 in written(bench)
    assert "1 of 1 objects of the configuration were written" in status(bench)
    bench.log.clear()
    bench.node.power_cycle()
    bench.run(2.0)
    assert status(bench).startswith("ok")
    before_start = written(bench)
    assert before_start.count(P151_IS_500) <= 1


def test_what_the_node_has_already_is_not_written(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node=P151))
    bench.node.on_frame(Frame(REQUEST, P151_IS_500), bench.now)
    bench.run(1.5)
    assert P151_IS_500 not in written(bench)
    assert status(bench).startswith("ok")


def test_a_value_that_the_node_refuses_is_j_with_object_and_value(tmp_path: Path) -> None:
    wrong = P151.replace("2097:01", "2FFF:01")
    bench = booted(tmp_path, node=wrong)
    assert status(bench).startswith("J: 2FFFh:01: the node aborted: ")
    assert "01F4h" in status(bench)
    assert not was_started(bench)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR


class Device:
    """Answers a boot-up generator as a node with these objects would."""

    def __init__(self, objects: dict[tuple[int, int], bytes], *, deaf: bool = False) -> None:
        self.objects = objects
        self.deaf = deaf
        self.writes: list[tuple[int, int, bytes]] = []

    def configure(self, *downloads: Download, store: bool = False) -> BootResult:
        result = BootResult()
        steps = configure(downloads, store=store, result=result)
        answer: bytes | SdoError | None = None
        while True:
            try:
                action = steps.throw(answer) if isinstance(answer, SdoError) else steps.send(answer)
            except StopIteration:
                return result
            answer = None if isinstance(action, BootStep) else self._answer(action)

    def _answer(self, action: object) -> bytes | SdoError:
        if isinstance(action, SdoWrite):
            self.writes.append((action.index, action.sub, action.data))
            if not self.deaf:
                self.objects[action.index, action.sub] = action.data
            return b""
        assert isinstance(action, SdoRead)
        found = self.objects.get((action.index, action.sub))
        return SdoError(action.index, action.sub, 0x06020000, by_server=True) if found is None else found


SPEED = Download(0x2401, 0, struct.pack("<I", 2500))


def test_a_node_that_has_our_configuration_date_is_left_alone() -> None:
    """STÖBER, §9: 1020h (A211/A212)."""
    device = Device({(0x1020, 1): bytes(4), (0x1020, 2): bytes(4), (0x2401, 0): bytes(4)})
    device.configure(SPEED, store=True)
    days, at_ms = configuration_stamp((SPEED,))
    assert device.writes == [
        (0x2401, 0, SPEED.data),
        (0x1020, 1, struct.pack("<I", days)),
        (0x1020, 2, struct.pack("<I", at_ms)),
        (0x1010, 1, b"save"),
    ]
    device.writes.clear()
    notes = device.configure(SPEED, store=True).notes
    assert device.writes == []
    assert [*map(render, notes)] == ["the node has this configuration already (1020h)"]


def test_another_configuration_has_another_date() -> None:
    other = Download(0x2401, 0, struct.pack("<I", 2501))
    assert configuration_stamp((SPEED,)) != configuration_stamp((other,))
    days, at_ms = configuration_stamp((SPEED,))
    assert 1 <= days <= 0xFFFF
    assert 0 <= at_ms < 86_400_000


def test_a_date_that_the_file_brings_is_taken() -> None:
    dated = (SPEED, Download(0x1020, 1, b"\x10\x27\0\0"), Download(0x1020, 2, b"\x01\0\0\0"))
    assert configuration_stamp(dated) == (10_000, 1)


def test_a_node_that_does_not_keep_a_value_is_named_with_both() -> None:
    device = Device({(0x2401, 0): struct.pack("<I", 7)}, deaf=True)
    with pytest.raises(BootError, match="J: 2401h:00 is 00000007h after 000009C4h was written"):
        device.configure(SPEED)


def test_a_command_is_written_blindly() -> None:
    device = Device({})
    device.configure(Download(0x1011, 1, b"load", read_back=False))
    assert device.writes == [(0x1011, 1, b"load")]


def test_a_mapping_from_a_dcf_is_written_with_the_pdo_off_and_sub_0_last() -> None:
    """CiA 301 §7.5.2.36."""
    device = Device(
        {
            (0x1800, 1): struct.pack("<I", 0x4000_0185),
            (0x1800, 2): b"\xff",
            (0x1A00, 0): b"\x01",
            (0x1A00, 1): struct.pack("<I", 0x30010110),
        }
    )
    device.configure(
        Download(0x1800, 2, b"\x01"),
        Download(0x1A00, 1, struct.pack("<I", 0x30030110)),
        Download(0x1A00, 2, struct.pack("<I", 0x30030210)),
        Download(0x1A00, 0, b"\x02"),
    )
    assert [(index, sub, int.from_bytes(data, "little")) for index, sub, data in device.writes] == [
        (0x1800, 1, 0xC000_0185),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x30030110),
        (0x1A00, 2, 0x30030210),
        (0x1A00, 0, 2),
        (0x1800, 2, 1),
        (0x1800, 1, 0x4000_0185),
    ]
