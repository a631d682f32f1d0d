"""PDO codecs and the time-outs that follow from transmission types."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.mapping import load_family
from bridge.southbound.boot import match_words
from bridge.southbound.canopen.pdo import Entry, MappingError, PdoCodec
from bridge.southbound.canopen.sync import burst_length, tpdo_deadline_s

NORD = load_family("nord/sk-tu4-cao")


def test_a_mapping_entry_is_index_sub_length() -> None:
    """BU 2500 §6.5.8: 3002h sub 3 with 16 bits is 30020310h."""
    entry = Entry.from_object(0x30020310)
    assert (entry.index, entry.sub, entry.bits) == (0x3002, 3, 16)
    assert entry.to_object() == 0x30020310


def test_four_words_little_endian() -> None:
    codec = PdoCodec(tuple(Entry(0x3000 + n, 1, 16) for n in range(4)))
    assert codec.pack((0x047F, 0x2000, 0, 0)) == bytes.fromhex("7F04002000000000")
    assert codec.unpack(bytes.fromhex("370B002000000000")) == (0x0B37, 0x2000, 0, 0)


@pytest.mark.parametrize("bits", [0, 1, 12, 24, 128])
def test_a_length_that_cannot_be_packed_is_named(bits: int) -> None:
    with pytest.raises(MappingError, match=f"3001:01/{bits}"):
        PdoCodec((Entry(0x3001, 1, bits),))


def test_more_than_eight_bytes_cannot_be_mapped() -> None:
    with pytest.raises(MappingError, match="10 bytes"):
        PdoCodec((Entry(0x6064, 0, 64), Entry(0x6041, 0, 16)))


@given(st.lists(st.sampled_from([8, 16, 32]), max_size=8).filter(lambda b: sum(b) <= 64), st.data())
def test_what_is_packed_is_unpacked(bits: list[int], data: st.DataObject) -> None:
    codec = PdoCodec(tuple(Entry(0x2000, n, length) for n, length in enumerate(bits)))
    values = tuple(data.draw(st.integers(0, 2**length - 1)) for length in bits)
    assert codec.unpack(codec.pack(values)) == values


@pytest.mark.parametrize("slot", NORD.slot, ids=lambda slot: slot.name)
@pytest.mark.parametrize("drives_have", [3, 5])
def test_both_setpoint_layouts_of_the_manual_are_recognised(slot: object, drives_have: int) -> None:
    """BU 2500 §7.1.2 P165: three to a drive; §6.7.5: five to a drive."""
    number = slot.rpdo.number  # type: ignore[attr-defined]
    first = (number - 1) * drives_have
    entries = (Entry(0x3000, number, 16), *(Entry(0x3002, first + n, 16) for n in (1, 2, 3)))
    assert match_words(entries, slot.rpdo.objects) == (0, 1, 2, 3)  # type: ignore[attr-defined]


def test_an_object_that_the_mapping_does_not_know_has_no_word() -> None:
    entries = (Entry(0x3001, 1, 16), Entry(0x2222, 0, 16), Entry(0x3003, 2, 16))
    assert match_words(entries, NORD.slot[0].tpdo.objects) == (0, None, 2)


@pytest.mark.parametrize(
    ("kind", "event_ms", "sync_ms", "expected"),
    [
        (255, 250, 10, 0.395),
        (254, 100, 0, 0.170),
        (1, 0, 10, 0.035),
        (10, 250, 10, 0.170),
        (0, 250, 10, None),  # only changes
        (255, 0, 10, None),
        (1, 0, 0, None),  # no SYNC, no PDO
    ],
)
def test_when_a_tpdo_is_late(kind: int, event_ms: int, sync_ms: int, expected: float | None) -> None:
    assert tpdo_deadline_s(kind, event_ms, sync_ms) == (None if expected is None else pytest.approx(expected))


@given(st.floats(0.001, 1.0), st.integers(10, 10_000))
def test_a_burst_never_outlives_the_dead_man_time(period_s: float, deadman_ms: int) -> None:
    count = burst_length(period_s, deadman_ms)
    assert count == 1 or count * period_s <= deadman_ms / 1000 + 1e-6
