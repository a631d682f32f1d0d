"""The judge of answers: it sees one that claims what the bus does not show, and takes a true one for true."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self, cast

import pytest

from tests.proof import examine
from tests.proof.asker import Answer
from tests.proof.drives import DRIVES
from tests.proof.rig import Rig
from tests.proof.witness import Run

PUMP = next(drive for drive in DRIVES if drive.reaction == "silence")
# EDS84DMOTCAN: bit 2 is the quick stop, bit 1 disables the voltage; at rest nothing may energise the motor.
RUN, QUICK_STOP, AT_REST, DISABLE = b"\x09\x00", b"\x0d\x00", b"\x05\x00", b"\x0f\x00"
YES, NO = Answer(forwarded=True, code="", message=""), Answer(forwarded=False, code="", message="sent before")


@dataclass
class Told:
    frames: list[tuple[float, bytes]] = field(default_factory=list[tuple[float, bytes]])

    def runs(self, can_id: int, since: float) -> list[Run]:
        return [Run(at, at, data) for at, data in self.frames if at >= since]

    def times(self, can_id: int, since: float) -> list[float]:
        return [at for at, _ in self.frames if at > since]

    def last(self, can_id: int) -> Run:
        return self.runs(can_id, 0.0)[-1]


class Scene:
    """A bus whose owner has fallen silent, and a bridge that answers and sends as it is told: for each stop
    the answer, and the frames with the seconds after it."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, script: list[tuple[Answer, dict[float, bytes]]]
    ) -> None:
        self.now = 1000.0
        self.told = Told([(900.0, RUN)])
        self.owners = dict.fromkeys(("modbus", "opcua", "zenoh"), self)
        self._script = script
        monkeypatch.setattr(examine, "time", self)
        monkeypatch.setattr(examine, "Asker", lambda: self)

    def signal(self, number: int) -> None:
        pass

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def wait(self, holds: Callable[[], bool], limit_s: float, what: str) -> None:
        assert holds()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def command(self, path: str, command: str) -> Answer:
        answer, frames = self._script.pop(0)
        self.told.frames += [(self.now + after, data) for after, data in frames.items()]
        return answer

    def finding(self) -> examine.Finding:
        (found,) = examine.stop_in_silence(cast(Rig, cast(Any, self)))
        return found


def script(**changes: tuple[Answer, dict[float, bytes]]) -> list[tuple[Answer, dict[float, bytes]]]:
    steps = {
        "quick": (YES, {0.05: QUICK_STOP, 0.15: QUICK_STOP}),
        "quick_again": (NO, {}),
        "quick_third": (NO, {}),
        "off": (YES, {0.05: DISABLE}),
        "off_again": (NO, {}),
        "off_third": (NO, {}),
    }
    return list({**steps, **changes}.values())


def test_a_stop_that_is_sent_once_and_answered_so_is_right(monkeypatch: pytest.MonkeyPatch) -> None:
    found = Scene(monkeypatch, script()).finding()
    assert (found.of, found.wrong) == (PUMP, "")
    (span,) = found.spans
    assert span.ms == pytest.approx(50)


def test_the_word_for_a_drive_at_rest_may_follow_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not Scene(monkeypatch, script(quick_again=(YES, {0.05: AT_REST}))).finding().wrong


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"quick": (YES, {})}, "answered forwarded, and not one frame was sent"),
        ({"quick": (NO, {0.05: QUICK_STOP})}, "was answered not forwarded: sent before"),
        ({"quick": (YES, {0.05: RUN})}, "in its silence sent 0900"),
        ({"quick": (YES, {0.05: QUICK_STOP, 0.75: QUICK_STOP})}, "ended its silence"),
        ({"off": (YES, {0.05: QUICK_STOP})}, "disable_voltage in its silence sent 0d00"),
        ({"quick_again": (YES, {})}, "again was answered forwarded, and 0 words were sent"),
        (
            {"quick_again": (NO, {0.05: AT_REST})},
            "again was answered not forwarded: sent before, and 1 words",
        ),
        ({"quick_again": (YES, {0.05: QUICK_STOP})}, "broke its silence again, by the same word 0d00"),
        (
            {"quick_again": (YES, {0.05: AT_REST}), "quick_third": (YES, {0.05: QUICK_STOP})},
            "broke its silence again, by the same word 0d00",
        ),
        (
            {"quick_again": (YES, {0.05: AT_REST}), "quick_third": (YES, {0.05: b"\x07\x00"})},
            "breaks its silence again and again",
        ),
    ],
)
def test_an_answer_that_is_not_true_and_a_silence_that_is_none_are_seen(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], wrong: str
) -> None:
    assert wrong in Scene(monkeypatch, script(**changes)).finding().wrong
