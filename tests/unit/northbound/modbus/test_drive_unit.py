"""Commanding a drive over Modbus: one write is one telegram, done whole or not at all."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Code, Event, EventKind, Identity, Outcome, PlantView, Reply, Request, Write
from tests.support.modbus_site import (
    ENABLED,
    OTHER_PLC,
    PLC,
    READY,
    SWITCH_ON_INHIBITED,
    Rig,
    float_words,
)

OK, NOT_ALLOWED, NO_ADDRESS, BAD_VALUE, NOT_CONFIGURED = 0, 1, 2, 3, 0x0A


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.runs(SWITCH_ON_INHIBITED)
    return rig


def requests_of(rig: Rig) -> list[Request]:
    """Every request that is made from now on."""
    seen: list[Request] = []
    submit = rig.view.submit

    def spy(request: Request, reply: Reply) -> None:
        seen.append(request)
        submit(request, reply)

    rig.view.submit = spy  # pyright: ignore[reportAttributeAccessIssue]
    return seen


def test_the_example_of_bu_2500_6_8(rig: Rig):
    """P105 = 50 Hz: 047E → ready, 047F/2000h → 25 Hz, 047E → stop."""
    assert rig.write(0, 0x047E, 0) == OK
    assert rig.sent == (0x047E, 0, 0, 0, 0)
    rig.runs(READY)
    assert rig.read(4, 0, 1)[0] & 0xFF == 0x31
    assert rig.write(0, 0x047F, 0x2000) == OK
    assert rig.sent == (0x047F, 0x2000, 0, 0, 0)
    rig.runs(ENABLED, 0x2000)
    assert rig.read(4, 0, 2) == [ENABLED, 0x2000]
    assert rig.read(4, 32, 2) == list(float_words(25.0))
    assert rig.write(0, 0x047E) == OK
    assert rig.sent[0] == 0x047E


def test_a_block_is_one_telegram(rig: Rig):
    seen = requests_of(rig)
    assert rig.write(0, 0x047E, 1, 2, 3) == OK
    assert [r.command for r in seen] == [
        Write({"control_word": 0x047E, "setpoint_1": 1, "setpoint_2": 2, "setpoint_3": 3})
    ]


def test_a_longer_block_is_values_acknowledge_then_keep_alive(rig: Rig):
    seen = requests_of(rig)
    assert rig.write(0, 0x047E, *[0] * 9, 1, 1) == OK
    assert [r.action for r in seen] == ["write", "reset_fault", "keep_alive"]
    seen.clear()
    assert rig.write(1, 7, *[0] * 8, 0) == OK
    assert [r.action for r in seen] == ["write", "release_control"]
    assert rig.fu1.channel.owner is None


def test_single_registers(rig: Rig):
    seen = requests_of(rig)
    for address, word, action in (
        (0, 0x047E, "write"),
        (3, 9, "write"),
        (10, 77, "keep_alive"),
        (11, 1, "reset_fault"),
        (11, 0, "keep_alive"),
        (10, 0, "release_control"),
    ):
        pdu = struct.pack(">BHH", 6, address, word)
        assert rig.ask(pdu) == pdu
        assert seen[-1].action == action


@pytest.mark.landing(30)
@pytest.mark.parametrize(
    ("start", "words", "code"),
    [
        (5, [0], NO_ADDRESS),  # a setpoint the drive does not have
        (5, [1, 0], NO_ADDRESS),
        (0, [0x047E, 0, 0, 0, 0, 1], BAD_VALUE),
        (9, [0], NO_ADDRESS),
        (9, [0, 1], OK),
        (9, [1, 1], BAD_VALUE),
        (0, [0x047E, *[0] * 8, 1], BAD_VALUE),
        (11, [2], BAD_VALUE),
        (0, [0x047E, *[0] * 10, 2], BAD_VALUE),
        (12, [500], NOT_ALLOWED),
        (0, [0x047E, *[0] * 11, 500], NOT_ALLOWED),
        (12, [200, 0], NOT_ALLOWED),
        (13, [0], BAD_VALUE),
        (13, [4], BAD_VALUE),
        (13, [0xFFFF], BAD_VALUE),
        (0, [0x047E, *[0] * 9, 1, 0, 200, 4], BAD_VALUE),
        (13, [1, 0], NO_ADDRESS),
        (14, [0], NO_ADDRESS),
        (31, [0], NO_ADDRESS),
        (30, [0, 0, 0, 0], NO_ADDRESS),
        (32, [0], NO_ADDRESS),
        (33, [0], NO_ADDRESS),
        (32, [0, 0, 0], NO_ADDRESS),
        (38, [0, 0], NO_ADDRESS),
        (65535, [0, 0], NO_ADDRESS),
        (0, [0x007E], BAD_VALUE),  # control data valid is 0
        (0, [0x007E, 5, *[0] * 8, 1], BAD_VALUE),
        (32, float_words(100.5), BAD_VALUE),
        (32, float_words(float("nan")), BAD_VALUE),
        (32, float_words(float("-inf")), BAD_VALUE),
    ],
)
def test_what_is_refused_changes_nothing(rig: Rig, start: int, words: list[int], code: int):
    channel = rig.fu1.channel
    before = (channel.control_word, channel.setpoints, channel.owner, channel.watchdog_state, rig.sent)
    assert rig.write(start, *words) == code
    after = (channel.control_word, channel.setpoints, channel.owner, channel.watchdog_state, rig.sent)
    assert (after == before) is (code != OK)


def test_what_is_refused_is_no_telegram(rig: Rig):
    rig.write(0, 0x047E)
    rig.pass_time(0.150)
    assert rig.write(0, 0x007E) == BAD_VALUE
    assert rig.write(32, *float_words(500.0)) == BAD_VALUE
    assert rig.write(32, 0) == NO_ADDRESS
    rig.pass_time(0.051)
    assert rig.fu1.channel.is_tripped


def test_a_float_setpoint_is_written_whole(rig: Rig):
    assert rig.write(0, 0x047E) == OK
    assert rig.write(32, *float_words(-12.5)) == OK
    assert rig.sent == (0x047E, 0xF000, 0, 0, 0)
    assert rig.write(32, *float_words(1.0), unit=9) == NOT_CONFIGURED


def test_someone_elses_drive_is_not_commanded(rig: Rig):
    assert rig.write(0, 0x047E, unit=2) == NOT_ALLOWED
    assert rig.write(10, 1, unit=2) == NOT_ALLOWED
    assert rig.write(0, 0x047E) == OK
    assert rig.write(0, 0x047F, caller=OTHER_PLC) == NOT_ALLOWED
    assert rig.write(10, 0, caller=OTHER_PLC) == NOT_ALLOWED
    assert rig.write(11, 0, caller=OTHER_PLC) == NOT_ALLOWED
    assert rig.read(4, 20, 1, caller=OTHER_PLC) == [2]
    assert rig.write(10, 0) == OK
    assert rig.read(4, 20, 1) == [0]
    assert rig.write(0, 0x047E, caller=OTHER_PLC) == OK


def test_refusals_by_the_drives_channel_are_told(rig: Rig):
    events: list[Event] = []
    rig.plant.on_event(events.append)
    rig.write(0, 0x047E, *[0] * 11, 500)
    assert [event.kind for event in events] == [EventKind.REFUSED]


def test_keep_alive_feeds_the_watchdog_and_zero_releases(rig: Rig):
    rig.write(0, 0x047E)
    for _ in range(5):
        rig.pass_time(0.150)
        assert rig.write(10, 1) == OK
    assert not rig.fu1.channel.is_tripped
    assert rig.write(10, 0) == OK
    rig.pass_time(1.0)
    assert not rig.fu1.channel.is_tripped


def test_acknowledge_after_a_trip_leaves_the_drive_stopped(rig: Rig):
    rig.write(0, 0x047E)
    rig.runs(ENABLED)
    rig.write(0, 0x047E)
    rig.write(0, 0x047F, 0x2000)
    rig.pass_time(0.201)
    assert rig.write(0, 0x047F, 0x2000) == OK  # taken, not forwarded
    assert rig.sent[0] & 0x000F != 0x000F
    assert rig.write(11, 1) == OK
    assert rig.read(4, 14, 1) == [2]
    assert rig.sent[0] & 0x000F != 0x000F
    assert rig.sent[1] == 0


def test_the_watchdog_time_is_its_owners_where_the_site_file_allows(rig: Rig):
    """fu3 may have 1…2000 ms, ten times what its site file says."""
    assert rig.write(12, 500, unit=9) == NOT_ALLOWED
    assert rig.write(10, 1, unit=9) == OK
    assert rig.write(12, 500, unit=9) == OK
    assert rig.read(3, 12, 1, unit=9) == [500]
    for refused in (0, 2001, 32768, 40_000):
        assert rig.write(12, refused, unit=9) == BAD_VALUE
    assert rig.write(0, 0x047E, *[0] * 9, 1, 0, 40000, unit=9) == BAD_VALUE
    assert rig.drive("fu3").channel.control_word == 0x0400
    assert rig.write(0, 0x047E, *[0] * 9, 1, 0, 300, unit=9) == OK
    assert rig.read(3, 12, 1, unit=9) == [300]
    assert rig.drive("fu3").channel.control_word == 0x047E
    assert rig.write(12, 400, unit=9, caller=OTHER_PLC) == NOT_ALLOWED
    assert rig.write(10, 0, unit=9) == OK
    assert rig.read(3, 12, 1, unit=9) == [200], "the site's own when the owner goes"


class TestStopForEverybody:
    """Holding register 13."""

    def moving(self) -> Rig:
        rig = Rig()
        rig.runs(READY)
        rig.write(0, 0x047E)
        rig.write(0, 0x047F, 0x2000)
        rig.runs(ENABLED, 0x2000)
        assert rig.sent[:2] == (0x047F, 0x2000)
        return rig

    @pytest.mark.landing(6)
    @pytest.mark.parametrize(("code", "word"), [(1, 0x047E), (2, 0x047B), (3, 0x0474)])
    @pytest.mark.parametrize("caller", [PLC, OTHER_PLC])
    def test_stops_by_every_function_that_writes_registers(self, code: int, word: int, caller: Identity):
        for pdu in (
            struct.pack(">BHH", 6, 13, code),
            struct.pack(">BHHBH", 16, 13, 1, 2, code),
            struct.pack(">BHHHHBH", 23, 0, 1, 13, 1, 2, code),
        ):
            rig = self.moving()
            assert not rig.ask(pdu, caller=caller)[0] & 0x80
            assert rig.sent[:2] == (word, 0)
            assert rig.read(3, 13, 1) == [0]
            assert rig.fu1.channel.owner == PLC
            assert rig.write(0, 0x047F, 0x2000) == OK
            assert rig.sent[0] == word, "what the owner goes on writing does not start it"

    def test_of_a_drive_that_another_protocol_controls(self):
        rig = Rig()
        assert rig.write(13, 2, unit=2) == OK

    def test_with_other_registers_it_is_all_that_is_done(self):
        rig = self.moving()
        assert rig.write(0, 0x047F, 0x3000, *[0] * 8, 0, 0, 500, 1, caller=OTHER_PLC) == OK
        assert rig.sent[:2] == (0x047E, 0)
        assert rig.fu1.channel.owner == PLC

    def test_a_0_among_others_is_none(self):
        rig = Rig()
        rig.write(10, 1, unit=9)
        assert rig.write(0, 0x047E, *[0] * 9, 1, 0, 300, 0, unit=9) == OK
        assert rig.drive("fu3").channel.control_word == 0x047E

    def test_an_owners_stop_is_a_telegram_and_anothers_is_none(self):
        for caller, left_ms in ((PLC, 200), (OTHER_PLC, 100)):
            rig = self.moving()
            rig.pass_time(0.1)
            rig.write(13, 1, caller=caller)
            assert rig.fu1.channel.left_ms(rig.now) == left_ms

    def test_is_refused_to_others_where_the_site_file_forbids_it(self):
        rig = Rig()
        rig.write(0, 0x047E, unit=9)
        assert rig.write(13, 1, unit=9, caller=OTHER_PLC) == NOT_ALLOWED
        assert rig.write(13, 1, unit=9) == OK


class TestAcknowledgeRegister:
    """Holding register 11, and the bit by whatever function writes it."""

    def tripped(self) -> Rig:
        rig = Rig()
        rig.runs(READY)
        rig.write(0, 0x047E)
        rig.pass_time(0.201)
        assert rig.fu1.channel.is_tripped
        return rig

    def test_a_1_in_each_block_acknowledges_once(self):
        rig = self.tripped()
        block = (0x047E, *[0] * 9, 1, 1)
        assert rig.write(0, *block) == OK
        assert not rig.fu1.channel.is_tripped
        for _ in range(3):
            rig.pass_time(0.201)
            assert rig.write(0, *block) == OK
            assert rig.fu1.channel.is_tripped
        assert rig.write(0, *block[:-1], 0) == OK
        assert rig.write(0, *block) == OK
        assert not rig.fu1.channel.is_tripped

    def test_a_single_1_acknowledges_each_time(self):
        rig = self.tripped()
        for _ in range(3):
            assert rig.write(11, 1) == OK
            assert not rig.fu1.channel.is_tripped
            rig.write(0, 0x047E)
            rig.pass_time(0.201)

    @pytest.mark.parametrize(
        "constant",
        [
            bytes.fromhex("05 0007 FF00"),
            bytes.fromhex("0F 0007 0001 01 01"),
            bytes.fromhex("16 0000 FF7F 0080"),
            bytes.fromhex("06 0000 04FE"),
            bytes.fromhex("17 0000 0001 0000 0001 02 04FE"),
        ],
    )
    def test_a_constant_bit_is_no_edge_beside_other_bits(self, constant: bytes):
        """Coils and masks are written beside the word as it is served."""
        rig = self.tripped()
        rig.write(0, 0x04FE)
        rig.write(0, 0x04FE)
        rig.pass_time(0.201)
        for between in ("06 000D 0001", "06 000A 0001", "05 0001 FF00", "0F 0002 0001 01 01"):
            rig.ask(between)
            rig.ask(constant)
            assert rig.fu1.channel.is_tripped, between
        rig.ask("05 0007 0000")
        rig.ask(constant)
        assert not rig.fu1.channel.is_tripped


def test_mask_write(rig: Rig):
    rig.write(0, 0x047E, 0x1234)
    request = bytes.fromhex("16 0000 FFFE 0001")
    assert rig.ask(request) == request
    assert rig.fu1.channel.control_word == 0x047F
    rig.write(1, 0x0012)
    rig.ask("16 0001 00F2 0025")  # §6.16's example
    assert rig.fu1.channel.setpoints[0] == 0x0017
    assert rig.ask("16 0009 0000 0000") == b"\x96\x02"
    assert rig.ask("16 000A 0000 0001") == b"\x96\x02"
    assert rig.ask("16 0005 FFFF 0000") == b"\x96\x02", "a setpoint the drive does not have"


WORD = st.integers(0, 0xFFFF)


@pytest.mark.landing
@given(WORD, WORD, WORD)
def test_a_mask_write_keeps_the_bits_of_one_mask_and_takes_the_others_of_the_other(
    held: int, and_mask: int, or_mask: int
):
    """Bit by bit, as §6.16 says: kept where the AND mask has a 1, else the bit of the OR mask."""
    rig = Rig()
    rig.runs(SWITCH_ON_INHIBITED)
    rig.write(1, held)
    rig.ask(struct.pack(">BHHH", 22, 1, and_mask, or_mask))
    (word,) = rig.read(3, 1, 1)
    for bit in range(16):
        source = held if and_mask >> bit & 1 else or_mask
        assert word >> bit & 1 == source >> bit & 1, f"bit {bit}"


def test_a_word_that_another_drive_of_the_family_has_is_no_address(rig: Rig):
    """setpoint_4, the digital outputs, goes with fu1."""
    assert rig.write(0, 0x047E) == OK
    assert rig.write(4, 3) == OK
    assert rig.sent[4] == 3
    assert rig.write(4, 0, unit=9) == NO_ADDRESS
    assert rig.read(3, 4, 1, unit=9) == [-NO_ADDRESS]
    assert rig.read(3, 3, 2, unit=9) == [0, 0]


def test_a_word_that_the_node_does_not_carry_is_not_configured(rig: Rig):
    unserved = {"command/setpoint_4": "RPDO5 is off"}
    rig.fu1.on_pdos(unserved, [], rig.now, deadline_s=None, rpdo_type=255)
    assert rig.write(4, 3) == NOT_CONFIGURED
    assert rig.read(3, 4, 1) == [-NOT_CONFIGURED]
    assert rig.write(0, 0x047E, 0, 0, 0, 3) == NOT_CONFIGURED
    assert rig.write(0, 0x047E, 1, 2, 3, 0) == OK
    assert rig.read(3, 0, 5) == [0x047E, 1, 2, 3, 0]


def test_bits_are_written_as_a_whole_number(rig: Rig):
    assert rig.write(0, 0x047E) == OK
    assert rig.write(34, 0, 3) == OK
    assert rig.sent[4] == 3
    assert rig.write(34, 1, 0) == BAD_VALUE


def test_read_write_writes_first(rig: Rig):
    answer = rig.ask("17 0000 0002 0000 0002 04 047E 2000")
    assert answer == bytes.fromhex("17 04 047E 2000")
    assert rig.fu1.channel.control_word == 0x047E


@pytest.mark.parametrize(
    ("pdu", "code"),
    [
        ("17 0022 0001 0000 0001 02 047E", NO_ADDRESS),  # the read leaves the map
        ("17 0021 0001 0000 0001 02 047E", NO_ADDRESS),  # the read is half a value
        ("17 0000 0001 0000 0001 02 007E", BAD_VALUE),
        ("17 0000 0001 0020 0001 02 0000", NO_ADDRESS),
    ],
)
def test_read_write_does_all_or_nothing(rig: Rig, pdu: str, code: int):
    assert rig.ask(pdu) == bytes((0x97, code))
    assert rig.fu1.channel.control_word == 0x0400
    assert rig.fu1.channel.owner is None


def test_coils_are_bits_of_the_control_word(rig: Rig):
    seen = requests_of(rig)
    rig.write(0, 0x047E)
    assert rig.ask("05 0000 FF00") == bytes.fromhex("05 0000 FF00")
    assert rig.fu1.channel.control_word == 0x047F
    rig.ask("05 0000 0000")
    assert rig.fu1.channel.control_word == 0x047E
    seen.clear()
    assert rig.ask("0F 0000 0010 02 7F0C") == bytes.fromhex("0F 0000 0010")  # 0C7F: run, right
    assert rig.fu1.channel.control_word == 0x0C7F
    assert len(seen) == 1
    assert rig.ask("05 000A 0000") == b"\x85\x03"  # control data valid must stay 1
    assert rig.ask("05 0010 FF00") == b"\x85\x02"
    assert rig.ask("0F 000F 0002 01 00") == b"\x8f\x02"
    assert rig.fu1.channel.control_word == 0x0C7F


@pytest.mark.landing
def test_a_late_outcome_is_answered_when_it_comes(rig: Rig, monkeypatch: pytest.MonkeyPatch):
    waiting: list[Reply] = []

    def submit(self: PlantView, request: Request, reply: Reply) -> None:
        waiting.append(reply)

    monkeypatch.setattr(PlantView, "submit", submit)
    answers: list[bytes] = []
    pdu = struct.pack(">BHHB11H", 16, 0, 11, 22, 0x047E, *[0] * 9, 1)
    rig.dispatcher.handle(1, pdu, OTHER_PLC, answers.append)
    assert len(waiting) == 1
    assert answers == []
    waiting[0](Outcome(Code.OK))
    assert len(waiting) == 2  # the keep-alive follows when the write is done
    waiting[1](Outcome(Code.TIMED_OUT))
    assert answers == [b"\x90\x04"]
