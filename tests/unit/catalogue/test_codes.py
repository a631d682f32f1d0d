"""Codes of points: none is given twice, and those that Modbus serves by themselves are as it tells them."""

from __future__ import annotations

import pytest

from bridge.catalogue.codes import (
    CONDITIONS,
    CONTROLLER_STATES,
    LAST_STOPS,
    NMT_STATES,
    NODE_CODES,
    NODE_STATES,
    WATCHDOG_STATES,
    NodeState,
    Source,
    WatchdogState,
)


def test_the_watchdogs_states_are_numbered_as_modbus_serves_them() -> None:
    """docs/reference: input register 14."""
    assert WATCHDOG_STATES == ((0, "off"), (1, "idle"), (2, "running"), (3, "tripped"))
    assert WatchdogState.TRIPPED.label == "tripped"


def test_owners_are_numbered_as_modbus_serves_them() -> None:
    """docs/reference: input register 20."""
    assert [(one.value, one.label) for one in Source] == [
        (0, "none"),
        (1, "opcua"),
        (2, "modbus"),
        (3, "zenoh"),
        (4, "local"),
    ]


def test_each_state_of_a_node_has_a_code() -> None:
    assert set(NODE_CODES) == set(NodeState)


@pytest.mark.parametrize(
    "states", [WATCHDOG_STATES, LAST_STOPS, NODE_STATES, NMT_STATES, CONTROLLER_STATES, CONDITIONS]
)
def test_no_code_and_no_name_is_given_twice(states: tuple[tuple[int, str], ...]) -> None:
    assert len(dict(states)) == len({name for _, name in states}) == len(states)
