"""Troubles as JSON: codes with facts, the worst first, no more than there is room for."""

from __future__ import annotations

import json

import pytest

from bridge.catalogue.codes import CONDITIONS
from bridge.condition.causes import Known, TroubleLine
from bridge.condition.point_troubles import Rank, Trouble
from bridge.condition.told import MOST, condition, troubles_json
from bridge.text import Text

LOST = Trouble(Rank.ALARM, "node_lost", "conveyor", (("how", "heartbeat"),))
DRIVE = Trouble(Rank.ALARM, "drive_lost", "conveyor/fu1")


@pytest.mark.parametrize(
    ("rank", "number", "word"),
    [(None, 0, "ok"), (Rank.WARNING, 1, "warning"), (Rank.ALARM, 2, "alarm"), (Rank.DANGER, 3, "danger")],
)
def test_the_worst_trouble_has_the_highest_number(rank: Rank | None, number: int, word: str) -> None:
    assert condition(rank) == number
    assert dict(CONDITIONS)[number] == word


def shown(trouble: Trouble, *explains: Known) -> TroubleLine:
    return TroubleLine(trouble, trouble.rank, 1234.4, explains=explains, is_or_longer=False, until_ms=None)


def test_a_trouble_is_told_with_its_facts() -> None:
    assert json.loads(troubles_json([shown(LOST)])) == [
        {
            "rank": "alarm",
            "kind": "node_lost",
            "place": "conveyor",
            "since": 1234,
            "facts": {"how": "heartbeat"},
        }
    ]


def test_a_fact_that_is_a_text_is_told_in_english_and_with_its_code() -> None:
    lost = Trouble(Rank.ALARM, "drive_lost", "conveyor/fu1", (("why", Text.of("node.lost")),))
    (told,) = json.loads(troubles_json([shown(lost)]))
    assert told["facts"] == {"why": "node lost"}
    assert told["texts"] == {"why": {"code": "node.lost", "facts": {}}}


def test_consequences_stand_within_their_cause() -> None:
    (told,) = json.loads(troubles_json([shown(LOST, Known(DRIVE, 5.0, 2000.0, is_or_longer=True))]))
    assert told["explains"] == [
        {
            "rank": "alarm",
            "kind": "drive_lost",
            "place": "conveyor/fu1",
            "since": 2000,
            "facts": {},
            "or_longer": True,
        }
    ]


def test_there_is_an_end_to_a_text() -> None:
    assert len(json.loads(troubles_json([shown(LOST)] * (MOST + 5)))) == MOST
    assert troubles_json([]) == "[]"
