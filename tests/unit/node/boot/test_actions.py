"""What a boot-up asks: steps in words, numbers in answers, objects that nothing needs, widths of a write."""

from __future__ import annotations

import pytest

from bridge.canopen.sdo import SdoError
from bridge.node.boot.actions import (
    BootResult,
    BootStep,
    DeviceErrors,
    DrivePlan,
    go_on_without,
    number,
    same,
    told_as,
    wish,
    write_number,
)
from bridge.node.boot.error_status import BootError
from bridge.text import Text, render
from tests.support.answering import Answering

SILENCE = SdoError(0x1008, 0, 0x0504_0000, by_server=False)
REFUSAL = SdoError(0x1008, 0, 0x0602_0000, by_server=True)


PDOS = Text.of("boot_step.pdos")


def test_a_step_names_the_key_that_asks_for_it() -> None:
    assert render(BootStep(PDOS, "J").said) == "reading the process data mapping"
    said = BootStep(PDOS, "J", needed_by="drive").said
    assert render(said) == "reading the process data mapping (needed by drive)"


def test_an_error_is_known_again_by_register_and_newest_code() -> None:
    assert DeviceErrors(0x11, (0x8240, 0x1000)).cause == (0x11, 0x8240)
    assert DeviceErrors(0x11).cause == (0x11, 0)


def test_of_reasons_to_leave_a_drive_out_the_first_counts() -> None:
    plan = DrivePlan()
    plan.leave_out(Text.of("boot.id_taken"))
    plan.leave_out(Text.of("boot.has_no", object="RPDO1"))
    assert plan.problem == Text.of("boot.id_taken")


@pytest.mark.parametrize(
    ("data", "size", "value"), [(b"\x34\x12", 2, 0x1234), (b"\xff", 1, 0xFF), (b"\1\0\0\x80", 4, 0x8000_0001)]
)
def test_a_number_has_its_low_byte_first(data: bytes, size: int, value: int) -> None:
    assert number(data, size=size) == value


def test_no_answer_is_the_default_and_a_text_is_no_number() -> None:
    assert number(None, 7) == 7
    with pytest.raises(BootError) as caught:
        number(bytes(100))
    assert (caught.value.letter, caught.value.detail) == (
        "J",
        "the node answers with 100 bytes where a number belongs",
    )


def test_what_the_node_holds_is_the_same_in_any_width() -> None:
    assert same(b"\5\0", b"\5\0")
    assert same(b"\5\0\0\0", b"\5\0")
    assert not same(b"\6\0", b"\5\0")
    assert not same(None, b"")


def test_an_object_that_nothing_needs_may_be_missing_without_a_word() -> None:
    result = BootResult()
    assert Answering().run(wish(result, 0x1008)) is None
    assert result.notes == []
    assert Answering({(0x1008, 0): b"SK"}).run(wish(result, 0x1008)) == b"SK"


def test_who_is_silent_about_two_of_them_is_noted_and_about_three_is_gone() -> None:
    result, node = BootResult(), Answering()
    node.silent = {(0x1008, 0)}
    for times in (1, 2):
        assert node.run(wish(result, 0x1008)) is None
        assert len(result.notes) == result.silences == times
    assert render(result.notes[0]).startswith("cannot be read, and is not needed: 1008h:00")
    with pytest.raises(SdoError):
        node.run(wish(result, 0x1008))


def test_where_a_drive_may_be_running_nothing_waits_for_silence() -> None:
    node = Answering()
    node.silent = {(0x1400, 1)}
    with pytest.raises(SdoError):
        node.run(wish(BootResult(), 0x1400, 1, may_be_silent=False))


def test_a_wrong_answer_is_no_silence() -> None:
    result = BootResult()
    for _ in range(5):
        go_on_without(REFUSAL, result)
    assert result.silences == 0


def test_a_refusal_is_told_as_something_else_and_silence_stays_silence() -> None:
    with pytest.raises(BootError, match="J: no"), told_as(lambda error: BootError("J", Text.plain("no"))):
        raise REFUSAL
    with pytest.raises(SdoError), told_as(lambda error: BootError("J", Text.plain("no"))):
        raise SILENCE


class Narrow(Answering):
    """Takes an object in four bytes alone."""

    code = 0x0607_0010

    def _answer(self, asked: object) -> bytes | SdoError | None:
        data = getattr(asked, "data", None)
        if data is not None and len(data) != 4:
            return SdoError(0x1017, 0, self.code, by_server=True)
        return super()._answer(asked)


def test_a_number_is_written_in_the_width_in_which_the_node_takes_it() -> None:
    """0607 0010h: the length of the service parameter does not match."""
    node = Narrow()
    node.run(write_number(0x1017, 0, b"\x64\0", None))
    assert node.writes == [(0x1017, 0, b"\x64\0\0\0")]


def test_a_refusal_for_another_reason_is_the_last_word() -> None:
    node = Narrow()
    node.code = 0x0609_0030
    with pytest.raises(SdoError):
        node.run(write_number(0x1017, 0, b"\x64\0", None))
    assert node.writes == []
