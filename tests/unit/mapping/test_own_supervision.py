"""Own supervision of a drive in its mapping file: defaults and refusals."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from bridge.mapping.own_supervision import OwnReaction, OwnSupervision

KEYS = {"name": "P513", "watches": "process_data", "parameter": "P513"}


def test_a_time_counts_in_milliseconds_and_0_is_off() -> None:
    one = OwnSupervision.model_validate(KEYS)
    assert (one.unit_ms, one.off, one.per_drive, one.data_type) == (1.0, [0], False, "uint16")
    assert one.reaction is None, "it stops"


def test_a_reaction_of_0_runs_on_where_nothing_else_is_said() -> None:
    assert OwnReaction.model_validate({"object": "6007:00"}).nothing == [0]


def test_two_do_not_share_their_lists() -> None:
    first, second = OwnSupervision.model_validate(KEYS), OwnSupervision.model_validate(KEYS)
    first.off.append(7)
    assert second.off == [0]


@pytest.mark.parametrize(
    "wrong", [{"watches": "sync"}, {"unit_ms": 0}, {"name": ""}, {"watch": "link"}, {"data_type": "word"}]
)
def test_what_it_may_not_say(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        OwnSupervision.model_validate({**KEYS, **wrong})
