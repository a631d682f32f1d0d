"""The ring keeps its bounds, whatever is written, and a disk that fails costs the recording alone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import pytest

from bridge.recorder.recording import Header, State, header_chunk, read, state_chunk
from bridge.recorder.ring import Ring, parts_of, segments_in, write_recording

MOST = 400_000
_LONGEST_S = 10.0


def until(done: Callable[[], bool]) -> None:
    """Wait for the ring's thread."""
    end = time.monotonic() + _LONGEST_S
    while not done():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def ring(tmp_path: Path) -> Iterator[Ring]:
    ring = Ring(tmp_path / "recorder", MOST, tmp_path / "black_box", MOST)
    assert ring.start() == 0
    yield ring
    ring.close()


def noise(seed: int, size: int) -> bytes:
    """Bytes that cannot be compressed."""
    return Random(seed).randbytes(size)


def begin(ring: Ring, number: int) -> None:
    header = Header(version="1", site="hall", buses=("can0",), number=number, began=0.0, epoch_ns=0)
    state = header_chunk(header) + state_chunk(State("", 0, {}, noise(number, 20_000)))
    ring.state_path(number).write_bytes(state)
    ring.begin(number)


def size_of(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.iterdir())


def test_the_ring_never_exceeds_its_bound(ring: Ring) -> None:
    for number in range(1, 12):
        begin(ring, number)
        for part in range(6):
            before = ring.size
            ring.put([noise(100 * number + part, 10_000)])
            until(lambda before=before: ring.size > before)
            assert size_of(ring.folder) <= MOST
    assert segments_in(ring.folder)[-1] == 11
    assert len(segments_in(ring.folder)) < 8


def test_a_segment_that_no_other_follows_ends_at_its_share(ring: Ring) -> None:
    begin(ring, 1)
    for part in range(60):
        ring.put([noise(part, 10_000)])
    until(lambda: ring.has_lost)
    assert size_of(ring.folder) <= MOST / 2
    assert ring.fault == ""


def test_segments_are_joined_to_a_recording(ring: Ring, tmp_path: Path) -> None:
    for number in (1, 2):
        begin(ring, number)
        ring.put([noise(number, 1000)])
    until(lambda: ring.size > 1000 and segments_in(ring.folder) == [1, 2])
    write_recording(parts_of(ring.folder, [1, 2]), tmp_path / "x.recording")
    segments = read(tmp_path / "x.recording")
    assert [segment.header.number for segment in segments] == [1, 2]
    assert [segment.turns for segment in segments] == [[noise(1, 1000)], [noise(2, 1000)]]


def test_a_segment_without_checkpoint_is_left_out(ring: Ring) -> None:
    ring.begin(1)
    begin(ring, 2)
    until(lambda: segments_in(ring.folder) == [1, 2])
    assert {path.stem for path in parts_of(ring.folder, [1, 2])} == {"000002"}


def test_the_oldest_of_the_black_box_give_way(ring: Ring) -> None:
    begin(ring, 1)
    ring.put([noise(1, 100_000)])
    for number in range(6):
        ring.keep([1], f"incident-{number}")
        until(lambda number=number: (ring.black_box / f"incident-{number}.recording").exists())
        assert size_of(ring.black_box) <= MOST
    assert sorted(path.stem for path in ring.black_box.iterdir())[-1] == "incident-5"
    assert len(list(ring.black_box.iterdir())) == 3


def test_a_disk_that_fails_costs_the_segment_alone(ring: Ring) -> None:
    begin(ring, 1)
    until(lambda: segments_in(ring.folder) == [1])
    away = ring.folder.rename(ring.folder.with_name("away"))
    ring.begin(2)
    until(lambda: bool(ring.fault))
    assert ring.has_lost
    away.rename(ring.folder)
    begin(ring, 3)
    ring.put([b"x"])
    until(lambda: not ring.fault and ring.size > 0)
    assert not ring.has_lost
