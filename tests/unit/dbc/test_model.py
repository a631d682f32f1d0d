"""Messages and signals as a DBC file has them: what they are where nothing else is said."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest

from bridge.config import NodeTable
from bridge.dbc.model import BRIDGE, Message, MessageSignal
from tests.support import sites


def test_a_signal_is_its_raw_number_without_limits() -> None:
    signal = MessageSignal("x", 0, 16)
    assert (signal.factor, signal.offset, signal.low, signal.high) == (1.0, 0.0, None, None)
    assert (signal.is_signed, signal.is_float, dict(signal.choices)) == (False, False, {})


def test_a_message_is_not_regular_unless_something_makes_it_so() -> None:
    message = Message(0x185, "x", 8, "conveyor", (BRIDGE,), ())
    assert (message.cycle_ms, dict(message.groups)) == (0, {})
    with pytest.raises(FrozenInstanceError):
        setattr(message, "cob_id", 0)  # noqa: B010


def test_no_node_of_a_site_can_be_called_as_the_bridge() -> None:
    keys = {"name": BRIDGE, "id": 5, "mapping": sites.FAMILY, "drive": [{"slot": "fu1"}]}
    with pytest.raises(ValueError):
        NodeTable.model_validate(keys)
