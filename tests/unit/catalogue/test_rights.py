"""Which points the clients of a protocol may ever write on a site: the tables of the reference.

``tests/unit/test_exports.py`` compares the same with a bridge that runs."""

from __future__ import annotations

import pytest

from bridge.catalogue import Catalogue, Rights, Source, rights_of
from tests.support import sites

FU1, FU2 = "conveyor/fu1", "conveyor/fu2"
ENGINEER, OPERATOR = (
    f'\n[[opcua.user]]\nname = "eve"\nrole = "{role}"\npassword_hash = "{"x" * 20}"\n'
    for role in ("engineer", "operator")
)
READ = 'parameters = "read"\n'
SETPOINT, RAMP, WATCH = "command/setpoint_1", "parameter/p102", "parameter/p513"
"""P513, the drive's own time-out, is protected: an engineer alone sets it."""
SERVERS = ("modbus", "opcua", "zenoh")


def site_with(control: str, *servers: str, drive: str = "", node: str = "") -> Catalogue:
    drives = [sites.drive(slot, control, 0, f"{sites.SCALED}\n{drive}") for slot in ("fu1", "fu2")]
    return sites.catalogue_of(sites.site(sites.bus(sites.node(*drives, more=node)), *servers))


def may(catalogue: Catalogue, rights: Rights, *leaves: str, drive: str = FU1) -> list[bool]:
    points = {point.name: point for point in catalogue.points}
    return [rights.may_write(catalogue, points[f"{drive}/{leaf}"]) for leaf in leaves]


def who(catalogue: Catalogue, leaf: str) -> list[str]:
    """The protocols whose clients may write it."""
    sources = (Source.MODBUS, Source.OPCUA, Source.ZENOH)
    return [
        source.label for source in sources if may(catalogue, rights_of(catalogue, source), leaf) == [True]
    ]


@pytest.mark.parametrize(
    ("control", "commanding"),
    [
        ("modbus", ["modbus"]),
        ("opcua", ["opcua"]),
        ("zenoh", ["zenoh"]),
        ("lease", ["opcua", "zenoh"]),
        ("none", []),
    ],
)
def test_a_drive_is_commanded_by_its_protocol_or_by_who_can_take_a_lease(
    control: str, commanding: list[str]
) -> None:
    catalogue = site_with(control)
    assert who(catalogue, SETPOINT) == commanding
    for is_for_all in (True, False):
        catalogue = site_with(control, drive=f"stop_by_anyone = {str(is_for_all).lower()}")
        drive = catalogue.drives[FU1]
        stopping = [source for source in SERVERS if Rights(Source[source.upper()]).may_stop(drive)]
        assert stopping == (list(SERVERS) if is_for_all else commanding)


@pytest.mark.parametrize(
    ("control", "setting"),
    [("modbus", ["modbus"]), ("opcua", []), ("zenoh", ["zenoh"]), ("lease", ["zenoh"]), ("none", [])],
)
def test_parameters_are_set_by_who_commands_where_there_are_no_roles(
    control: str, setting: list[str]
) -> None:
    catalogue = site_with(control, sites.modbus(), sites.opcua(), sites.zenoh())
    assert who(catalogue, RAMP) == setting
    assert who(catalogue, WATCH) == []


@pytest.mark.parametrize(
    ("servers", "setting"),
    [
        ((), ["zenoh"]),
        ((sites.zenoh(),), ["zenoh"]),
        ((sites.zenoh() + READ,), []),
        ((sites.modbus() + READ,), ["zenoh"]),
        ((sites.modbus() + READ, sites.zenoh()), ["zenoh"]),
        ((sites.modbus(), sites.zenoh() + READ), []),
    ],
)
def test_where_a_protocol_only_reads_parameters_nobody_sets_them_by_it(
    servers: tuple[str, ...], setting: list[str]
) -> None:
    """One that is not served counts as with the settings that it would have."""
    assert who(site_with("zenoh", *servers), RAMP) == setting


@pytest.mark.parametrize("control", ["modbus", "opcua", "none"])
@pytest.mark.parametrize(("users", "are_set"), [("", False), (OPERATOR, False), (OPERATOR + ENGINEER, True)])
def test_an_engineer_sets_the_parameters_of_every_drive(control: str, users: str, are_set: bool) -> None:
    catalogue = site_with(control, sites.opcua() + users)
    rights = rights_of(catalogue, Source.OPCUA)
    assert may(catalogue, rights, RAMP, WATCH) == [are_set] * 2
    assert may(catalogue, rights, SETPOINT) == [control == "opcua"]


def test_without_a_channel_to_the_drive_nobody_sets_its_parameters() -> None:
    for node, is_reached in (("", False), ("sdo_channels = [2]", True)):
        catalogue = site_with("zenoh", sites.opcua() + ENGINEER, node=node)
        for source in (Source.OPCUA, Source.ZENOH):
            assert may(catalogue, rights_of(catalogue, source), RAMP) == [True]
            assert may(catalogue, rights_of(catalogue, source), RAMP, drive=FU2) == [is_reached]


def test_what_is_only_shown_is_written_by_nobody() -> None:
    catalogue = site_with("opcua", sites.opcua() + ENGINEER)
    rights = rights_of(catalogue, Source.OPCUA)
    shown = [point for point in catalogue.points if not point.writable]
    assert len(shown) > 100
    assert [point.name for point in shown if rights.may_write(catalogue, point)] == []
    assert f"{FU1}/parameter/p701_1" in {point.name for point in shown}


def test_what_stands_for_a_communication_object_is_set_by_nobody() -> None:
    """A211 of a STÖBER is 1020h:01 (CAN 5000, §11.2)."""
    drive = sites.drive("axis1", "opcua", 0, "")
    text = sites.site(sites.bus(sites.node(drive, mapping="stoeber/5000")), sites.opcua() + ENGINEER)
    catalogue = sites.catalogue_of(text, "stoeber/5000")
    (name,) = catalogue.drives
    (point,) = (point for point in catalogue.points if point.name == f"{name}/parameter/a211")
    assert point.writable
    assert not rights_of(catalogue, Source.OPCUA).may_write(catalogue, point)
