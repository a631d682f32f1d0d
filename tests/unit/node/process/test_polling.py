"""Polls of a mapping file: how often an object is asked for, who spares a question, and who refuses it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.image import Image
from bridge.mapping.model import Poll
from bridge.node.process.polling import Polling


class Channel:
    """Notes what is asked; the answers are given by the test."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, int]] = []
        self.open: list[Callable[[Result], None]] = []

    def read(self, index: int, sub: int, now: float, done: Callable[[Result], None], **more: Any) -> None:
        assert more == {"priority": Priority.POLL}
        self.asked.append((index, sub))
        self.open.append(done)


class Case:
    def __init__(self, *polls: tuple[str, str, int]) -> None:
        self.channel = Channel()
        self.shown: list[tuple[str, int, float]] = []
        models = [
            Poll.model_validate({"name": name, "object": ref, "every_ms": ms, "data_type": "int16"})
            for name, ref, ms in polls
        ]
        channel = cast("SdoChannel", self.channel)
        self.polling = Polling(models, channel, cast("Image", self), "io/node")
        self.polling.start([], 10.0)

    def put(self, name: str, value: int, now: float) -> None:
        """As the image."""
        self.shown.append((name, value, now))

    def at(self, now: float) -> list[tuple[int, int]]:
        """What is asked then."""
        self.channel.asked.clear()
        self.polling.on_time(now)
        return list(self.channel.asked)


HEAT = ("heat", "2000:01", 1000)


def test_each_is_asked_at_once_and_in_its_period() -> None:
    case = Case(HEAT, ("load", "2000:02", 500))
    assert case.at(10.0) == [(0x2000, 1), (0x2000, 2)]
    for done in case.channel.open:
        done(b"\1\0")
    assert case.at(10.4) == []
    assert case.polling.next_deadline() == 10.5
    assert case.at(10.5) == [(0x2000, 2)]


def test_the_answer_is_shown_with_its_sign_and_the_time_of_the_last_round() -> None:
    case = Case(HEAT)
    case.at(10.0)
    case.at(10.25)
    case.channel.open[0](b"\xfe\xff")
    assert case.shown == [("io/node/heat", -2, 10.25)]


def test_of_a_slow_node_no_more_questions_pile_up() -> None:
    case = Case(HEAT)
    case.at(10.0)
    assert case.at(11.0) == []
    case.channel.open[0](b"\0\0")
    assert case.at(12.0) == [(0x2000, 1)]


def test_a_time_out_is_asked_again_and_a_refusal_is_the_last_word() -> None:
    case = Case(HEAT)
    case.at(10.0)
    case.channel.open[-1](SdoError(0x2000, 1, 0x0504_0000, by_server=False))
    assert case.at(11.0) == [(0x2000, 1)]
    case.channel.open[-1](SdoError(0x2000, 1, 0x0602_0000, by_server=True))
    assert case.polling.next_deadline() is None
    assert case.at(99.0) == []


def test_what_a_pdo_brings_is_not_asked_for_meanwhile() -> None:
    case = Case(HEAT)
    case.polling.on_pdo("heat", 7, 10.0, 12.0)
    assert case.shown == [("io/node/heat", 7, 10.0)]
    assert case.at(10.0) == []
    assert case.polling.next_deadline() == 12.0
    assert case.at(12.0) == [(0x2000, 1)]


def test_after_the_end_nothing_is_asked_until_it_starts_anew() -> None:
    case = Case(HEAT)
    case.polling.on_pdo("heat", 7, 10.0, 99.0)
    case.polling.stop()
    assert case.at(20.0) == []
    case.polling.start([], 20.0)
    assert case.at(20.0) == [(0x2000, 1)]
