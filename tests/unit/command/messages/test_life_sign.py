"""A telegram proves a connection, a life sign proves a program (docs/explanation/dead-man-chain.md)."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Code, Command, Identity, SetTimeout, Source, TakeControl, Write
from bridge.command import Start as StartCommand
from bridge.command.leg.event import Connection
from bridge.command.leg.outlook import until
from bridge.command.messages.life_sign import LifeSign
from bridge.drive import DriveState
from bridge.image import Value
from tests.support.leg import TOKENS, Leg, settings_of, told

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
ACKNOWLEDGE = SHUT_DOWN | 0x80
PLC = Identity(Source.MODBUS, "192.168.0.7", connection="port 51234")
OPERATOR = Identity(Source.OPCUA, "ann")
A_MOMENT_S = 1e-6
TIMEOUT_S = 3.0
SEEDS = st.tuples(st.integers(0, 65_534), st.integers(1_000, 64_000)).filter(
    lambda seed: math.gcd(seed[1], 65_535) == 1
)


class TestTokens:
    def test_another_one_is_offered_each_second(self):
        tokens = [TOKENS.token(second) for second in range(65_535)]
        assert len(set(tokens)) == 65_535, "none comes twice in 18 hours"
        assert 0 not in tokens, "0 is what a program has that has read none"
        assert max(tokens) == 65_535
        assert TOKENS.token(7.0) == TOKENS.token(7.999)

    @given(SEEDS, st.floats(0, 1e9), st.floats(0, 60_000))
    def test_one_is_known_by_when_it_was_offered_first(self, seed: tuple[int, int], now: float, ago: float):
        life = LifeSign(*seed)
        offered = math.floor(max(now - ago, 0.0))
        assert life.issued_at(life.token(offered), now) == offered

    @pytest.mark.parametrize("token", [1, 65_535])
    def test_the_least_and_the_greatest_are_known_as_well(self, token: int):
        life = LifeSign(start=token - 1, step=20_002)
        assert life.token(0.5) == token
        assert life.issued_at(token, 1.5) == 0.0

    @pytest.mark.parametrize("number", [0, -1, 65_536])
    def test_a_number_that_is_none_was_never_offered(self, number: int):
        assert TOKENS.issued_at(number, 1000.0) is None

    def test_who_counts_on_from_the_last_one_finds_an_old_one(self):
        """A gateway that counts up what it writes proves no more than one that repeats it."""
        now = 1000.0
        ages = [now - (TOKENS.issued_at(TOKENS.token(now) + step, now) or 0.0) for step in range(1, 6)]
        assert min(ages) > 32.767, "older than any time-out"

    def test_each_drive_and_each_start_has_its_own(self):
        seeds = {LifeSign.at_random() for _ in range(50)}
        assert len(seeds) == 50
        assert all(math.gcd(life.step, 65_535) == 1 for life in seeds)
        assert all(1000 <= life.step <= 64_535 for life in seeds), "no program counts so far"


class Drive(Leg):
    """A NORD drive that asks for a life sign, with a time-out of 3 s. Its clock begins at 100 s."""

    def __init__(self, **given: object) -> None:
        keys = {"life_sign": True, "fieldbus_timeout_ms": round(TIMEOUT_S * 1000), **given}
        super().__init__(settings_of("nord/sk-tu4-cao", **keys))

    def takes(self, command: Command | Action, who: Identity = PLC) -> bool:
        self.asks(command, who)
        return self.outcome.ok

    def telegram(self, word: int | None = None, token: int | None = None, who: Identity = PLC) -> bool:
        values: dict[str, Value] = {} if word is None else {"control_word": word}
        if token is not None:
            values["life_sign"] = token
        return self.takes(Write(values), who)

    def offered(self, ago_s: float = 0.0) -> int:
        return TOKENS.token(self.now - ago_s)

    def runs(self) -> None:
        assert self.telegram(SHUT_DOWN, self.offered())
        assert self.telegram(RUN, self.offered())
        self.says(DriveState.OPERATION_ENABLED)
        assert self.enables


class TestATelegram:
    def test_without_a_token_counts_for_nothing(self):
        drive = Drive()
        for command in (Write({"control_word": RUN}), Action.KEEP_ALIVE, Action.RESET_FAULT, StartCommand()):
            before = drive.state
            assert not drive.takes(command)
            assert drive.outcome.code is Code.NOT_VALID
            assert "life sign" in drive.outcome.message
            assert drive.state == before

    def test_with_a_fresh_one_counts_until_that_is_as_old_as_the_time_out(self):
        drive = Drive()
        drive.now = 100.7
        drive.runs()
        assert until(drive.settings, drive.state) == 103.0, "it was offered first at 100"

    @pytest.mark.parametrize(("ago_s", "counts"), [(0.0, True), (2.0, True), (3.0, False), (60.0, False)])
    def test_with_an_old_one_counts_as_long_as_the_time_out(self, ago_s: float, counts: bool):
        drive = Drive()
        assert drive.telegram(SHUT_DOWN, drive.offered(ago_s)) is counts

    @pytest.mark.parametrize("token", [0, 1, 30_000])
    def test_with_a_number_that_was_not_offered_counts_for_nothing(self, token: int):
        drive = Drive()
        assert not drive.telegram(SHUT_DOWN, token)
        assert drive.outcome.code is Code.NOT_VALID

    @pytest.mark.parametrize("token", [-1, 65_536, 1.5, True, "7"])
    def test_with_what_is_no_word_is_refused_as_that(self, token: Value):
        drive = Drive()
        assert not drive.takes(Write({"control_word": SHUT_DOWN, "life_sign": token}))
        assert drive.outcome.code is Code.OUT_OF_RANGE

    def test_may_bring_it_back_alone_and_the_others_count_as_long(self):
        """An I/O scanner writes the token and the words in two requests."""
        drive = Drive()
        assert drive.telegram(token=drive.offered())
        drive.now += 1.5
        assert drive.telegram(SHUT_DOWN)
        assert drive.telegram(RUN)
        assert until(drive.settings, drive.state) == 103.0, "they prove nothing by themselves"

    def test_of_a_drive_that_asks_for_none_brings_none(self):
        drive = Drive(life_sign=False)
        assert not drive.telegram(SHUT_DOWN, 7)
        assert drive.outcome.code is Code.UNKNOWN_POINT


class TestARelay:
    """It goes on writing what its controller wrote last."""

    def repeats(self, drive: Drive, seconds: float) -> None:
        token = drive.offered()
        end = drive.now + seconds
        while drive.now < end - A_MOMENT_S:
            drive.telegram(RUN, token)
            drive.waits(0.0625)

    @pytest.mark.parametrize("offset_s", [0.0, 0.5, 0.99])
    def test_moves_a_drive_no_longer_than_the_time_out(self, offset_s: float):
        drive = Drive()
        drive.now += offset_s
        drive.runs()
        self.repeats(drive, TIMEOUT_S)
        assert drive.state.stage.is_tripped
        assert not drive.enables

    def test_cannot_acknowledge_the_trip(self):
        drive = Drive()
        drive.runs()
        self.repeats(drive, TIMEOUT_S)
        assert not drive.takes(Action.RESET_FAULT)
        drive.telegram(SHUT_DOWN, drive.offered(60.0))
        assert not drive.telegram(RUN | 0x80, drive.offered(60.0))
        assert drive.state.stage.is_tripped

    def test_a_program_that_lives_acknowledges_and_goes_on(self):
        drive = Drive()
        drive.runs()
        self.repeats(drive, TIMEOUT_S)
        for word in (SHUT_DOWN, ACKNOWLEDGE, SHUT_DOWN, RUN):
            assert drive.telegram(word, drive.offered())
        assert drive.enables

    def test_a_living_program_never_trips(self):
        """It reads the token at any moment and brings it back 0.4 s later, each 0.3 s."""
        drive = Drive()
        drive.runs()
        read = drive.offered()
        for _ in range(400):
            token, read = read, drive.offered()
            drive.waits(0.3)
            assert drive.telegram(RUN, token)
        assert drive.enables


class TestAStop:
    def test_by_the_owners_word_is_carried_out_without_a_token(self):
        drive = Drive()
        drive.runs()
        drive.now += TIMEOUT_S - 0.1
        drive.state = drive.state._replace(owner=drive.state.owner._replace(alive_until=drive.now))
        deadline = drive.state.timer.deadline
        assert drive.telegram(SHUT_DOWN)
        assert drive.outcome.message == "came without a life sign, and counts as a stop only"
        assert not drive.enables
        assert drive.state.timer.deadline == deadline, "and is no sign of life"

    @pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
    @pytest.mark.parametrize("who", [PLC, OPERATOR])
    def test_by_command_is_carried_out_and_keeps_nothing_alive(self, action: Action, who: Identity):
        drive = Drive()
        drive.runs()
        drive.waits(TIMEOUT_S)
        timer = drive.state.timer
        assert timer.is_overdue
        assert drive.takes(action, who)
        assert drive.state.timer == timer

    def test_a_release_needs_none(self):
        drive = Drive()
        drive.runs()
        drive.waits(TIMEOUT_S)
        assert drive.takes(Action.RELEASE_CONTROL)
        assert drive.state.owner.identity is None


class TestWhoseItIs:
    def test_another_owner_brings_its_own(self):
        drive = Drive()
        drive.runs()
        drive.waits(TIMEOUT_S)
        other = replace(PLC, user="192.168.0.8")
        assert not drive.telegram(SHUT_DOWN, who=other)
        assert drive.telegram(SHUT_DOWN, drive.offered(), other)

    def test_the_next_connection_of_the_owner_goes_on_with_it(self):
        drive = Drive()
        drive.runs()
        drive.happens(Connection(PLC, is_there=False))
        assert drive.telegram(RUN, who=replace(PLC, connection="port 2"))

    def test_a_lease_is_taken_without_one_and_keeps_what_was_brought(self):
        drive = Drive(control="lease")
        assert drive.takes(TakeControl(60_000))
        assert not drive.takes(Action.KEEP_ALIVE)
        drive.runs()
        assert drive.takes(TakeControl(60_000))
        assert drive.telegram(RUN)

    def test_a_longer_time_out_of_the_owner_counts_for_the_token_it_has_brought(self):
        drive = Drive(fieldbus_timeout_writable=True)
        drive.runs()
        assert drive.takes(SetTimeout(5000))
        assert until(drive.settings, drive.state) == 105.0
        assert not drive.takes(SetTimeout(1000)), "what a living program brings may be as old"

    def test_errors_that_are_ignored_do_not_make_a_telegram_of_a_repetition(self):
        drive = Drive(telegram_downtime_s=-0.1)
        drive.runs()
        drive.waits(TIMEOUT_S)
        assert not drive.telegram(RUN, drive.offered(60.0))
        assert told(drive.effects)


@given(
    events=st.lists(
        st.tuples(
            st.sampled_from((RUN, RUN, SHUT_DOWN, ACKNOWLEDGE, None)),
            st.sampled_from((None, 0.0, 1.0, 2.0, 2.9, 5.0, 40.0)),
            st.sampled_from((0.0, 0.3, 1.0, 2.7)),
        ),
        max_size=40,
    )
)
def test_what_enables_is_sent_only_while_the_newest_token_is_younger_than_the_time_out(
    events: list[tuple[int | None, float | None, float]],
):
    drive = Drive()
    drive.says(DriveState.READY)
    newest = -math.inf
    for word, ago_s, pause_s in events:
        is_taken = drive.telegram(word, None if ago_s is None else drive.offered(ago_s))
        if is_taken and ago_s is not None:
            newest = max(newest, math.floor(drive.now - ago_s))
        assert not drive.enables or drive.now < newest + TIMEOUT_S
        end = until(drive.settings, drive.state)
        assert end is None or end <= newest + TIMEOUT_S, "nor does the kernel go on"
        drive.waits(pause_s)
