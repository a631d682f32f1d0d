"""Generators that ask a node, and who runs them."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from bridge.canopen import abort
from bridge.canopen.dialogue import Dialogue, SdoRead, SdoWrite, ask, attempt, optional
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result, SdoChannel, SdoError
from bridge.canopen.sdo_queue import MOST_WAITING

Steps = Generator[SdoRead | SdoWrite, bytes | None, list[object]]
Ends = list[list[object] | SdoError]


class Client:
    """Runs dialogues on one channel, of which the server is the test."""

    def __init__(self) -> None:
        self.sdo = SdoChannel(0x605, 0x585, 0.5)
        self.ends: Ends = []
        self.now = 0.0

    def begin(self, steps: Steps) -> Dialogue[SdoRead | SdoWrite, bytes | None, list[object], SdoError]:
        def do(step: SdoRead | SdoWrite, now: float) -> bool:
            ask(step, self.sdo, now, lambda answer: dialogue.go_on(answer, self.now))
            return True

        dialogue = Dialogue(steps, do, lambda end, now: self.ends.append(end), (SdoError,))
        dialogue.go_on(None, self.now)
        return dialogue

    def sent(self) -> list[str]:
        return [frame.data.hex(" ") for frame in self.sdo.take_frames()]

    def answer(self, data: str) -> None:
        self.sdo.on_frame(Frame(0x585, bytes.fromhex(data), self.now))


def refusal(code: int) -> str:
    return (b"\x80\x00\x10\x00" + code.to_bytes(4, "little")).hex()


def test_reads_and_writes_go_to_the_channel_and_answers_come_back() -> None:
    def steps() -> Steps:
        return [(yield SdoRead(0x1000)), (yield SdoWrite(0x1017, 0, b"\xf4\x01"))]

    client = Client()
    client.begin(steps())
    assert client.sent() == ["40 00 10 00 00 00 00 00"]
    client.answer("43 00 10 00 92 01 02 00")
    assert client.sent() == ["2b 17 10 00 f4 01 00 00"]
    assert client.ends == []
    client.answer("60 17 10 00 00 00 00 00")
    assert client.ends == [[b"\x92\x01\x02\x00", b""]]


def test_an_error_is_thrown_at_the_step_that_it_belongs_to() -> None:
    def steps() -> Steps:
        try:
            yield SdoRead(0x1000)
        except SdoError as error:
            return [error.code]
        return []

    client = Client()
    client.begin(steps())
    client.answer(refusal(abort.GENERAL))
    assert client.ends == [[abort.GENERAL]]


def test_an_error_that_nobody_catches_is_the_end() -> None:
    def steps() -> Steps:
        yield SdoRead(0x1000)
        return []

    client = Client()
    client.begin(steps())
    client.sdo.on_time(0.5)
    [end] = client.ends
    assert isinstance(end, SdoError)
    assert end.code == abort.TIMED_OUT


def test_an_error_of_another_kind_is_a_fault_of_the_program() -> None:
    def steps() -> Steps:
        yield SdoRead(0x1000)
        raise KeyError

    client = Client()
    client.begin(steps())
    with pytest.raises(KeyError):
        client.answer("43 00 10 00 92 01 02 00")


def test_what_is_read_at_will_may_be_missing_and_not_silent() -> None:
    def steps() -> Steps:
        return [(yield from optional(0x1000)), (yield from optional(0x1000))]

    client = Client()
    client.begin(steps())
    client.answer(refusal(0x0602_0000))
    assert client.ends == []
    client.sdo.on_time(0.5)
    [end] = client.ends
    assert isinstance(end, SdoError)


def test_an_attempt_has_the_error_for_its_result() -> None:
    def steps() -> Steps:
        return [(yield from attempt(0x1000)), (yield from attempt(0x1000))]

    client = Client()
    client.begin(steps())
    client.answer("43 00 10 00 92 01 02 00")
    client.answer(refusal(abort.GENERAL))
    [[read, refused]] = [end for end in client.ends if isinstance(end, list)]
    assert read == b"\x92\x01\x02\x00"
    assert isinstance(refused, SdoError)


def test_a_queue_that_is_full_refuses_before_ask_returns() -> None:
    def steps() -> Steps:
        return [(yield from attempt(0x1000)), (yield from attempt(0x1001))]

    client = Client()
    ignored: list[Result] = []
    for _ in range(MOST_WAITING + 1):
        client.sdo.read(0x1018, 1, 0.0, ignored.append)
    client.begin(steps())
    [end] = client.ends
    assert isinstance(end, list)
    assert [error.code for error in end if isinstance(error, SdoError)] == [abort.BUSY] * 2


def test_a_step_that_waits_for_nothing_is_followed_by_the_next() -> None:
    def steps() -> Generator[str, bytes | None, str]:
        yield "one"
        yield "two"
        return "three"

    seen: list[str] = []

    def do(step: str, now: float) -> bool:
        seen.append(step)
        return step == "two"

    dialogue = Dialogue(steps(), do, lambda end, now: seen.append(str(end)), (SdoError,))
    dialogue.go_on(None, 0.0)
    assert seen == ["one", "two"]
    dialogue.go_on(None, 0.0)
    assert seen == ["one", "two", "three"]
    dialogue.go_on(None, 0.0)
    assert seen == ["one", "two", "three"]


def test_one_that_was_closed_has_no_result_and_hears_no_answer() -> None:
    closed: list[bool] = []

    def steps() -> Steps:
        try:
            yield SdoRead(0x1000)
        finally:
            closed.append(True)
        return []

    client = Client()
    asked = steps()
    dialogue = client.begin(asked)
    dialogue.close()
    assert closed == [True], "though somebody else may hold it, too"
    client.answer("43 00 10 00 92 01 02 00")
    assert client.ends == []
