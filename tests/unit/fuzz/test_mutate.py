"""Mutated inputs: repeatable, different, and changed where it matters."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from random import Random

import pytest

from tests.fuzz.case import Case, load, read_cases, write_cases
from tests.fuzz.judge import growth_mb, unrightful
from tests.fuzz.mutate import LONGEST, Mutator
from tests.fuzz.targets import PROTOCOLS
from tests.fuzz.targets.can_target import FRAME, is_allowed
from tests.fuzz.targets.zenoh_target import batches, with_length

TEXT = b"conveyor/fu1"
MESSAGE = b"\x01\x00\xa1\x02" + struct.pack("<I", len(TEXT)) + TEXT + bytes(range(40))


def many(seed: int, texts: bool = True) -> list[bytes]:
    mutator = Mutator(Random(seed), texts=texts)
    return [mutator.mutate(MESSAGE, (MESSAGE, b"another one")) for _ in range(500)]


def test_the_same_seed_gives_the_same_messages() -> None:
    assert many(1) == many(1)
    assert many(1) != many(2)


def test_messages_differ_and_keep_within_bounds() -> None:
    found = many(3)
    assert len(set(found)) > 400
    assert max(map(len, found)) <= LONGEST
    assert b"" in {Mutator(Random(seed)).mutate(b"x") for seed in range(200)}, "nothing at all is thrown, too"


def test_texts_that_are_no_utf8_come_with_their_right_length() -> None:
    """The fault that ended the OPC UA front: all else is as it should be."""

    def is_one(message: bytes) -> bool:
        size = int.from_bytes(message[4:8], "little")
        text, rest = message[8 : 8 + size], message[8 + size :]
        if message[:4] != MESSAGE[:4] or rest != bytes(range(40)):
            return False
        try:
            text.decode()
        except UnicodeDecodeError:
            return True
        return False

    assert any(map(is_one, many(4)))


def test_pieces_are_the_message() -> None:
    mutator = Mutator(Random(5))
    for size in (0, 1, 2, 100):
        data = bytes(range(size))
        assert all(b"".join(mutator.cut(data)) == data for _ in range(50))


def test_json_is_changed_in_its_words() -> None:
    mutator = Mutator(Random(6))
    found = {mutator.mutate_text(b'{"control_word": 1151, "setpoint_1": 8192}') for _ in range(500)}

    def is_json(text: bytes) -> bool:
        try:
            json.loads(text)
        except (ValueError, RecursionError):
            return False
        return True

    assert len([text for text in found if is_json(text)]) > 20, "what is JSON gets further"
    assert any(not is_json(text) for text in found)


def test_cases_are_kept_as_they_were(tmp_path: Path) -> None:
    cases = [Case("stream", (b"\0\xff", b"")), Case("raw", ())]
    write_cases(tmp_path / "deep" / "cases.jsonl", cases)
    assert read_cases(tmp_path / "deep" / "cases.jsonl") == cases


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_each_protocol_has_its_recorded_messages(protocol: str) -> None:
    assert len(load(protocol).recorded) >= 20


def test_frames_that_command_by_themselves_are_not_thrown() -> None:
    for can_id in (0x000, 0x205, 0x505, 0x206, 0x606, 0x605, 0x7E5, 0x185, 0x705, 0x085, 0x77F):
        assert not is_allowed(FRAME.pack(can_id) + b"\x01"), f"{can_id:X}h"
    for can_id in (0x080, 0x086, 0x187, 0x588, 0x709, 0x7E4):
        assert is_allowed(FRAME.pack(can_id)), f"{can_id:X}h"


def test_batches_of_zenoh_are_taken_apart() -> None:
    stream = with_length(b"one") + with_length(b"") + with_length(b"two")
    assert batches(stream + b"\x05\x00x") == ([b"\x03\0one", b"\0\0", b"\x03\0two"], b"\x05\x00x")


def test_memory_that_grows_for_ever_is_not_flat() -> None:
    assert growth_mb([50 + second * 0.5 for second in range(100)]) == pytest.approx(25, abs=1)
    warming = [50 + min(second, 30) * 1.0 for second in range(100)]
    assert growth_mb(warming) == 0
    assert growth_mb([50.0] * 98 + [500.0, 50.0]) == 0, "a spike is none"


@pytest.mark.parametrize(
    ("target", "action", "is_right"),
    [
        ("conveyor/fu4", "start", True),
        ("spare/fu1", "write", True),
        ("conveyor/fu1", "write", False),
        ("pump/drive", "take_control", False),
        ("pump/drive", "stop", True),
        ("spare", "reset", True),
    ],
)
def test_what_a_stranger_may_do(target: str, action: str, is_right: bool) -> None:
    line = {"source": "modbus", "user": "127.0.0.9", "target": target, "action": action, "code": "ok"}
    assert (not unrightful(line)) is is_right
    assert not unrightful({**line, "code": "not_allowed"})
