"""PDO codecs and the time-outs that follow from transmission types."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.habits import HabitCounter
from bridge.canopen.pdo import MappingError, PdoCodec, PdoEntry
from bridge.canopen.sync import burst_length, tpdo_deadline_s
from bridge.command import EventQueue
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.mapping.model import Pdo
from bridge.node.boot import PdoPlan, factory_entries, layouts, match_words
from bridge.node.places.word_map import WordPlace
from bridge.node.process.process_data import DrivePdos
from bridge.node.process.remote_polling import RemotePolling
from bridge.node.process.unfit_frames import UnfitFrames
from tests.support.bench import Bench, write_site
from tests.support.node_states import node_goes

NORD = load_family("nord/sk-tu4-cao")


def test_a_mapping_entry_is_index_sub_length() -> None:
    """BU 2500 §6.5.8: 3002h sub 3 with 16 bits is 30020310h."""
    entry = PdoEntry.from_object(0x30020310)
    assert (entry.index, entry.sub, entry.bits) == (0x3002, 3, 16)
    assert entry.to_object() == 0x30020310


@pytest.mark.parametrize(
    ("index", "is_dummy"), [(0x0000, False), (0x0001, True), (0x001F, True), (0x0020, False), (0x6041, False)]
)
def test_an_index_of_a_data_type_stands_for_a_gap(index: int, is_dummy: bool) -> None:
    """CiA 301 §7.4.7: 0001h to 001Fh are the simple types."""
    assert PdoEntry(index, 0, 16).is_dummy == is_dummy


def test_four_words_little_endian() -> None:
    codec = PdoCodec(tuple(PdoEntry(0x3000 + n, 1, 16) for n in range(4)))
    assert codec.pack((0x047F, 0x2000, 0, 0)) == bytes.fromhex("7F04002000000000")
    assert codec.unpack(bytes.fromhex("370B002000000000")) == (0x0B37, 0x2000, 0, 0)


@pytest.mark.parametrize("bits", [0, 65, 128])
def test_a_length_that_cannot_be_packed_is_named(bits: int) -> None:
    with pytest.raises(MappingError, match=rf"^3001:01/{bits}: "):
        PdoCodec((PdoEntry(0x3001, 1, bits),))


def test_more_than_eight_bytes_cannot_be_mapped() -> None:
    with pytest.raises(MappingError, match="10 bytes"):
        PdoCodec((PdoEntry(0x6064, 0, 64), PdoEntry(0x6041, 0, 16)))
    with pytest.raises(MappingError, match="9 bytes"):
        PdoCodec((PdoEntry(0x6064, 0, 64), PdoEntry(0x6041, 0, 1)))


def lengths(sizes: st.SearchStrategy[int]) -> st.SearchStrategy[list[int]]:
    return st.lists(sizes, max_size=64).filter(lambda bits: sum(bits) <= 64)


@given(lengths(st.sampled_from([8, 16, 32, 64])) | lengths(st.integers(1, 64)), st.data())
def test_what_is_packed_is_unpacked(bits: list[int], data: st.DataObject) -> None:
    entries = tuple(PdoEntry(0x2000, n, length) for n, length in enumerate(bits))
    signs = [data.draw(st.booleans()) for _ in bits]
    codec = PdoCodec(entries, {(0x2000, n) for n, sign in enumerate(signs) if sign})
    values = tuple(
        data.draw(st.integers(-(2 ** (b - 1)), 2 ** (b - 1) - 1) if s else st.integers(0, 2**b - 1))
        for b, s in zip(bits, signs, strict=True)
    )
    packed = codec.pack(values)
    assert len(packed) == codec.length == (sum(bits) + 7) // 8
    assert codec.unpack(packed) == values


@pytest.mark.parametrize("bits", [16, 12])
@pytest.mark.parametrize("values", [(1,), (1, 2, 3)])
def test_there_is_a_value_for_each_object(bits: int, values: tuple[int, ...]) -> None:
    codec = PdoCodec((PdoEntry(0x2000, 1, bits), PdoEntry(0x2000, 2, bits)))
    with pytest.raises(ValueError):
        codec.pack(values)


def test_an_object_of_any_length_has_all_its_bits() -> None:
    for bits in range(1, 65):
        codec = PdoCodec((PdoEntry(0x2000, 0, bits),))
        highest = (1 << bits) - 1
        data = highest.to_bytes((bits + 7) // 8, "little")
        assert (codec.pack((highest,)), codec.unpack(data)) == (data, (highest,))


@given(lengths(st.integers(1, 64)), st.integers(0, 2**64 - 1))
def test_bits_follow_each_other_from_the_lowest(bits: list[int], number: int) -> None:
    """CiA 301 §7.5.2.36: the first object begins at bit 0 of the first byte."""
    codec = PdoCodec(tuple(PdoEntry(0x2000, n, length) for n, length in enumerate(bits)))
    number &= (1 << sum(bits)) - 1
    expected, rest = [], number
    for length in bits:
        expected.append(rest & ((1 << length) - 1))
        rest >>= length
    assert codec.unpack(number.to_bytes(codec.length, "little")) == tuple(expected)


def test_a_bit_mapped_pdo() -> None:
    """Three bits, a bit, a nibble, a signed 12-bit value, a byte across the boundary of bytes."""
    codec = PdoCodec(
        tuple(PdoEntry(0x2000, n, bits) for n, bits in enumerate((3, 1, 4, 12, 8))), signed={(0x2000, 3)}
    )
    assert codec.length == 4
    assert codec.unpack(bytes.fromhex("AD FF 5F 05")) == (5, 1, 10, -1, 0x55)
    assert codec.pack((5, 1, 10, -1, 0x55)) == bytes.fromhex("ADFF5F05")


# between PDO and words


class Words:
    """A drive whose PDOs are these; ``seen`` are the words of its last TPDO, ``told`` what was rejected."""

    def __init__(self, bench: Bench, tpdo: PdoPlan, rpdo: PdoPlan | None = None) -> None:
        self.drive = bench.plant.drives["conveyor/fu1"]
        node_goes(bench.plant, bench.plant.nodes["conveyor"], NodeState.OPERATIONAL, 1.0)
        self._events = EventQueue()
        unfit = UnfitFrames("conveyor", self._events, HabitCounter(), None)
        self.pdos = DrivePdos(self.drive, [rpdo or tpdo], [tpdo], unfit)

    @property
    def told(self) -> list[str]:
        return [event.message.rpartition(": ")[2] for event in self._events.waiting]

    def receive(self, data: str) -> list[int]:
        self.pdos.tpdos[0].on_frame(Frame(0x185, bytes.fromhex(data), 2.0))
        return self.drive.words

    def sent(self, *words: int) -> bytes:
        (frame,) = self.pdos.frames_with(words)
        return frame.data


def plan(*bits: int, words: tuple[int | None, ...], kind: int = 255, signed: tuple[int, ...] = ()) -> PdoPlan:
    entries = tuple(PdoEntry(0x2000, n, length) for n, length in enumerate(bits))
    places = tuple(
        None if word is None else WordPlace(word, (length + 15) // 16)
        for word, length in zip(words, bits, strict=True)
    )
    return PdoPlan(0x185, kind, 0, PdoCodec(entries, {(0x2000, n) for n in signed}), places)


def matched(entries: tuple[PdoEntry, ...], pdo: Pdo) -> tuple[int | None, ...]:
    """The words that these entries are, by the layouts of this PDO; the first of those that are several."""
    names = [f"word_{n}" for n in range(len(pdo.objects))]
    places = match_words(entries, layouts([pdo], [names], names))
    return tuple(None if place is None else place.word for place in places)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(write_site(tmp_path), present=False)


def test_an_object_behind_the_words_is_left_out(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, 8, 8, 16, words=(0, 1, 2, 3, None)))
    assert words.receive("31 0B 00 20 03 04 FF FF") == [0x0B31, 0x2000, 3, 4]
    assert words.receive("37 0B 01 20 03 04 FF FF") == [0x0B37, 0x2001, 3, 4]


def test_an_rpdo_of_the_first_words_leaves_the_others_out(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, words=(0, 1)))
    assert words.sent(0x047F, 0x1_2000, 7, 8) == bytes.fromhex("7F040020")


def test_an_rpdo_of_short_words_has_their_low_bits(bench: Bench) -> None:
    words = Words(bench, plan(16, 8, words=(0, 1)))
    assert words.sent(0x047F, 0x1234) == bytes.fromhex("7F0434")


def test_a_long_object_fills_several_words_the_low_one_first(bench: Bench) -> None:
    """BU 2500 §6.5.4: a position of 2800.758 rev is 002ABC76h."""
    words = Words(bench, plan(16, 32, words=(0, 1)))
    assert words.receive("370B 76BC2A00") == [0x0B37, 0xBC76, 0x002A, 0]
    assert words.sent(0x047F, 0xBC76, 0x002A, 0, 0) == bytes.fromhex("7F0476BC2A00")


def test_a_short_signed_object_fills_its_word_with_its_sign(bench: Bench) -> None:
    assert Words(bench, plan(16, 8, words=(0, 1), signed=(1,))).receive("370BFF")[1] == 0xFFFF
    assert Words(bench, plan(16, 8, words=(0, 1))).receive("370BFE")[1] == 0x00FE


def test_a_dummy_is_received_by_nobody_and_sent_as_zero(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, 16, words=(0, None, 1)))
    assert words.receive("370B FFFF 0020") == [0x0B37, 0x2000, 0, 0]
    assert words.sent(0x047F, 0x2000, 0, 0, 0) == bytes.fromhex("7F0400000020")


def test_words_may_stand_in_any_order(bench: Bench) -> None:
    assert Words(bench, plan(16, 16, words=(1, 0))).receive("0020370B") == [0x0B37, 0x2000, 0, 0]


def test_of_a_pdo_that_is_too_long_the_mapped_bytes_count(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, words=(0, 1)))
    assert words.receive("370B0020FFFF") == [0x0B37, 0x2000, 0, 0]
    assert words.told == ["4 bytes are mapped"]


def test_a_pdo_that_is_too_short_changes_nothing(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, words=(0, 1)))
    words.receive("370B0020")
    assert words.receive("310B00") == [0x0B37, 0x2000, 0, 0]
    assert words.told == ["4 bytes are mapped"]


def test_an_object_named_for_two_words_is_32_bits_long_where_the_node_has_no_mapping() -> None:
    objects = [["6041:00"], ["6064:00"], ["6064:00"]]
    pdo = Pdo.model_validate({"number": 1, "cob_id": 0x180, "objects": objects})
    entries = factory_entries(pdo)
    assert entries == (PdoEntry(0x6041, 0, 16), PdoEntry(0x6064, 0, 32))
    assert matched(entries, pdo) == (0, 1)


def test_a_tpdo_of_type_253_is_asked_for(bench: Bench) -> None:
    words = Words(bench, plan(16, 16, words=(0, 1), kind=253))
    polling = RemotePolling()
    polling.start([words.pdos], 10.0)
    asked: list[tuple[float, Frame]] = []
    now = 10.0
    while now < 10.35:
        polling.on_time(now)
        asked += [(round(now, 3), frame) for frame in polling.take_frames()]
        deadline = polling.next_deadline()
        assert deadline is not None
        now = deadline
    assert [at for at, _ in asked] == [10.0, 10.1, 10.2, 10.3]
    assert asked[0][1] == Frame(0x185 | REMOTE, bytes(4))
    polling.stop()
    assert polling.next_deadline() is None


def test_a_tpdo_of_another_type_is_not_asked_for(bench: Bench) -> None:
    polling = RemotePolling()
    polling.start([Words(bench, plan(16, words=(0,))).pdos], 10.0)
    assert polling.next_deadline() is None


# a whole node


def stale_after(bench: Bench) -> float:
    """Time from the last TPDO until its values are stale, seconds."""
    bench.run(1.0)
    drive = bench.plant.drives["conveyor/fu1"]
    assert drive.quality is Quality.GOOD
    assert drive.channel.link.pdo_deadline_s is not None
    return drive.channel.link.pdo_deadline_s


def test_the_site_file_can_say_when_a_tpdo_is_late(tmp_path: Path) -> None:
    assert stale_after(Bench(write_site(tmp_path))) == pytest.approx(0.395)
    assert stale_after(Bench(write_site(tmp_path, drive="tpdo_deadline_ms = 300"))) == 0.3


def test_a_tpdo_that_is_never_late(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive="tpdo_deadline_ms = 0"))
    bench.run(1.0)
    assert bench.plant.drives["conveyor/fu1"].channel.link.pdo_deadline_s is None


def test_a_synchronous_rpdo_goes_out_before_sync_and_counts_in_the_worst_case(tmp_path: Path) -> None:
    asynchronous = Bench(write_site(tmp_path))
    asynchronous.run(1.0)
    bench = Bench(write_site(tmp_path, drive="rpdo = { transmission_type = 1 }"))
    bench.run(1.0)
    name = "conveyor/fu1/supervision/worst_case_stop_ms"
    assert bench.number(name) == asynchronous.number(name) + 10
    bench.keep_writing(0.2, control_word=0x047E, setpoint_1=0)
    assert bench.number("conveyor/fu1/status/status_word") & 0x6F == 0x21, "taken over by SYNC"
    cycle = [frame.can_id for frame in bench.log if frame.can_id in (0x080, 0x205)][-20:]
    assert cycle[cycle.index(0x205) :][:4] == [0x205, 0x080, 0x205, 0x080]


def test_without_sync_a_synchronous_pdo_is_reported(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, bus="sync_period_ms = 0", drive="rpdo = { transmission_type = 1 }"))
    bench.run(1.0)
    assert "RPDO of type 1 waits for SYNC" in str(bench.value("conveyor/node/boot_status"))
    reading = bench.plant.image.read("conveyor/fu1/supervision/worst_case_stop_ms")
    assert reading.quality is Quality.CONFIG_ERROR
    assert "waits for a SYNC that somebody else sends" in reading.reason


ENABLE_TPDO5 = 'configure = [{ object = "1804:01", type = "uint32", value = 0x400001C5 }]'


def input_reads(bench: Bench) -> int:
    return sum(frame.data[:4] == bytes.fromhex("40053000") for frame in bench.sent(0x605))


def test_the_digital_inputs_come_by_tpdo5_where_it_is_on(tmp_path: Path) -> None:
    """BU 2500 §6.4: 1C0h + node id."""
    bench = Bench(write_site(tmp_path, node=ENABLE_TPDO5))
    bench.run(3.0)
    reads = input_reads(bench)
    assert reads <= 1
    bench.node.image.inputs = 0b0101
    bench.node.on_time(bench.now)
    bench.run(0.3)
    assert bench.value("conveyor/node/digital_inputs") == 0b0101
    bench.run(2.0)
    assert input_reads(bench) == reads


def test_they_are_polled_where_it_is_off(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(3.0)
    assert input_reads(bench) >= 4


def test_they_are_polled_again_when_it_falls_silent(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node=ENABLE_TPDO5))
    bench.run(2.0)
    reads = input_reads(bench)
    bench.node.slave._store.current.tpdo[4].enabled = False
    bench.node.slave.touch()
    bench.node.image.inputs = 0b0010
    bench.run(2.0)
    assert input_reads(bench) > reads
    assert bench.value("conveyor/node/digital_inputs") == 0b0010


@pytest.mark.parametrize("slot", NORD.slot, ids=lambda slot: slot.name)
@pytest.mark.parametrize("drives_have", [3, 5])
def test_both_setpoint_layouts_of_the_manual_are_recognised(slot: object, drives_have: int) -> None:
    """BU 2500 §7.1.2 P165: three to a drive; §6.7.5: five to a drive."""
    number = slot.rpdo[0].number  # type: ignore[attr-defined]
    first = (number - 1) * drives_have
    entries = (PdoEntry(0x3000, number, 16), *(PdoEntry(0x3002, first + n, 16) for n in (1, 2, 3)))
    assert matched(entries, slot.rpdo[0]) == (0, 1, 2, 3)  # type: ignore[attr-defined]


def test_an_object_that_the_mapping_does_not_know_has_no_word() -> None:
    entries = (PdoEntry(0x3001, 1, 16), PdoEntry(0x2222, 0, 16), PdoEntry(0x3003, 2, 16))
    assert matched(entries, NORD.slot[0].tpdo[0]) == (0, None, 2)


@pytest.mark.parametrize(
    ("kind", "event_ms", "sync_ms", "expected"),
    [
        (255, 250, 10, 0.395),
        (254, 100, 0, 0.170),
        (1, 0, 10, 0.035),
        (10, 250, 10, 0.170),
        (240, 0, 10, 3.620),
        (241, 250, 10, None),  # reserved, as are those up to 251
        (251, 250, 10, None),
        (0, 250, 10, None),  # only changes
        (255, 0, 10, None),
        (1, 0, 0, None),  # no SYNC, no PDO
        (252, 0, 10, 0.170),  # asked for every 100 ms
        (253, 0, 10, 0.170),
    ],
)
def test_when_a_tpdo_is_late(kind: int, event_ms: int, sync_ms: int, expected: float | None) -> None:
    assert tpdo_deadline_s(kind, event_ms, sync_ms, 100) == (
        None if expected is None else pytest.approx(expected)
    )


def test_a_tpdo_that_nobody_asks_for_is_never_late() -> None:
    assert tpdo_deadline_s(252, 250, 10, 0) is None
    assert tpdo_deadline_s(253, 250, 10) is None


@given(st.floats(0.001, 1.0), st.integers(10, 10_000))
def test_a_burst_is_as_long_as_the_dead_man_time_allows(period_s: float, deadman_ms: int) -> None:
    count = burst_length(period_s, deadman_ms)
    assert count == 1 or count * period_s <= deadman_ms / 1000 + 1e-6
    assert (count + 1) * period_s > deadman_ms / 1000 - 1e-6


@pytest.mark.parametrize(
    ("period_s", "deadman_ms", "count"), [(0.1, 300, 3), (0.01, 400, 40), (0.02, 99, 4), (1.0, 400, 1)]
)
def test_a_burst_whose_last_frame_ends_with_the_dead_man_time(
    period_s: float, deadman_ms: int, count: int
) -> None:
    assert burst_length(period_s, deadman_ms) == count
