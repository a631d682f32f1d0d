"""Who asks for what: identities and roles, and what a request has where nothing else is said."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Identity, Outcome, ReadParameter, Role, Source, command_of
from bridge.command.drive_link import NodeState
from bridge.northbound.zenoh.keys import outcome_json
from tests.support.docs import page
from tests.support.rig import READY, Rig

CONTROLLER = Identity(Source.MODBUS, "10.0.0.1")


def test_an_owner_is_served_by_the_numbers_of_the_reference() -> None:
    rows = page("reference/modbus.md").table("Input registers of a drive")
    (meaning,) = [row["meaning"] for row in rows if row["name"] == "supervision/owner"]
    assert meaning == ", ".join(f"{source.value} {source.label}" for source in Source)


@pytest.mark.parametrize(
    ("other", "is_same"),
    [
        (Identity(Source.MODBUS, "10.0.0.1", Role.ENGINEER, "10.0.0.1:40001"), True),
        (Identity(Source.MODBUS, "10.0.0.2"), False),
        (Identity(Source.ZENOH, "10.0.0.1"), False),
        (None, False),
    ],
)
def test_a_controller_is_its_protocol_and_its_name(other: Identity | None, is_same: bool) -> None:
    """Whatever connection it uses, and whatever it may do."""
    assert CONTROLLER.is_same(other) is is_same


@pytest.mark.parametrize(
    ("role", "is_let", "may"),
    [
        (Role.OBSERVER, False, False),
        (Role.OPERATOR, False, False),
        (Role.ENGINEER, False, True),
        (Role.OPERATOR, True, True),
        (Role.ENGINEER, True, True),
    ],
)
def test_parameters_are_set_by_engineers_and_by_who_is_let(role: Role, is_let: bool, may: bool) -> None:
    assert Identity(Source.OPCUA, "ann", role, sets_parameters=is_let).may_set_parameters is may
    if not is_let:
        assert Identity(Source.OPCUA, "ann", role).may_set_parameters is may


def test_roles_go_from_reading_to_setting() -> None:
    assert Role.OBSERVER < Role.OPERATOR < Role.ENGINEER < Role.ADMIN
    assert len(Role) == 4


def test_a_start_without_a_direction_leaves_that_to_the_drive() -> None:
    """047Fh: none of the bits for a direction (BU 2500 §6.5.1)."""
    rig = Rig(fieldbus_timeout_ms=0)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    rig.submit(Action.START)
    assert rig.sent == 0x047F


def test_an_outcome_without_more_says_no_more() -> None:
    assert outcome_json(Outcome(Code.OK)) == b'{"ok":true,"forwarded":true}'
    refused = outcome_json(Outcome(Code.NOT_READY, "no"))
    assert b"abort_code" not in refused


def test_a_read_that_says_nothing_of_its_age_takes_no_old_value() -> None:
    """None that is older than 0 ms: the drive is asked."""
    assert command_of(Action.READ_PARAMETER, "P102") == ReadParameter("P102", max_age_ms=0)


def test_a_lease_without_a_length_has_none() -> None:
    rig = Rig(control="lease")
    (outcome,) = rig.submit(Action.TAKE_CONTROL)
    assert outcome.code is Code.OUT_OF_RANGE
    assert command_of(Action.TAKE_CONTROL) == command_of(Action.TAKE_CONTROL, 0)
