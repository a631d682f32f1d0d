"""The demo's controller, with answers of the test."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from bridge.sim.controller import Controller, Move, Times

FAN = "drives/demo/fan/drive"
QUICK = Times(cycle_s=0.0, run_s=0.02, pause_s=0.01, retry_s=0.0, away_s=0.01)


class Session:
    """Answers by the last words of a key; what is not among ``answers`` is done."""

    def __init__(self, **answers: object) -> None:
        self.answers = {"node/state": {"s": "operational"}, "status/state": {"s": "operation_enabled"}}
        self.answers |= answers
        self.asked: list[str] = []

    def get(self, key: str, **how: object) -> list[Any]:
        leaf = "/".join(key.split("/")[-2:])
        self.asked.append(leaf.rpartition("/")[2])
        content = json.dumps(self.answers.get(leaf, {"ok": True}))
        payload = SimpleNamespace(to_string=lambda: content)
        return [SimpleNamespace(ok=SimpleNamespace(payload=payload), err=None)]


def controller(session: Session, times: Times = QUICK) -> Controller:
    made: Any = session
    return Controller(made, Move(FAN, "velocity", 1500.0), times)


def test_a_move_is_written_as_a_key_and_a_number() -> None:
    move = Move.from_text(f"{FAN}/command/velocity=1500")
    assert move == Move(FAN, "velocity", 1500.0)
    assert Move.from_text(str(move)) == move
    for wrong in ("velocity=1500", f"{FAN}/command/velocity=fast"):
        with pytest.raises(ValueError, match=r"."):
            Move.from_text(wrong)


def test_it_takes_control_moves_and_stops_and_goes_on_writing() -> None:
    session = Session()
    assert controller(session).run_once()
    order = ["take_control", "reset_fault", "disable_voltage", "start", "velocity", "stop", "keep_alive"]
    assert [one for one in dict.fromkeys(session.asked) if one in order] == order


def test_a_node_that_is_not_there_is_not_taken() -> None:
    session = Session(**{"node/state": {"s": "lost"}})
    assert not controller(session).run_once()
    assert "take_control" not in session.asked


def test_who_is_stopped_by_somebody_else_gives_way() -> None:
    answers = {"status/state": {"s": "ready"}, "supervision/owner": {"v": ""}}
    session = Session(**answers, **{"command/keep_alive": {"ok": False}})
    assert not controller(session, replace(QUICK, run_s=60.0, retry_s=0.001)).run_once()
    assert "release_control" in session.asked


def test_nobody_answers() -> None:
    session: Any = SimpleNamespace(get=lambda *_, **__: [])
    assert Controller(session, Move(FAN, "velocity", 1.0), QUICK).ask("stop")["code"] == "no_answer"
