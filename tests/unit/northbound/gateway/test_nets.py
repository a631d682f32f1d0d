"""Nets of the ASCII gateway: a bus with its nodes, their parameters, and where its frames are heard."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge import __version__
from bridge.northbound.gateway.gateway_session import Net
from bridge.northbound.gateway.nets import net_of
from tests.support import sites


def net(interface: str = "virtual", *, slot: str = "fu1") -> Net:
    channel = 'channel = "vcan0"' if interface == "socketcan" else ""
    bus = sites.bus(sites.node(sites.drive(slot, "none", 0, "")), interface=interface, more=channel)
    other = sites.bus(sites.node(sites.drive("fu1", "none", 0, ""), name="other"), name="can1")
    catalogue = sites.catalogue_of(sites.site(bus, other))
    return net_of(catalogue.site.bus[0], 3, catalogue.nodes.values(), Path("/run/hall-can0.frames"))


def test_it_has_the_nodes_of_its_bus_alone() -> None:
    found = net()
    assert (found.number, found.nodes) == (3, {5: ("conveyor", "conveyor/fu1")})


def test_a_node_whose_first_channel_reaches_no_drive_of_the_site_has_no_parameters() -> None:
    """SDO1 of a SK TU4-CAO reaches FU1 (BU 2500 §6.4)."""
    assert net(slot="fu2").nodes == {5: ("conveyor", None)}


@pytest.mark.parametrize(
    ("interface", "place"), [("socketcan", "socketcan vcan0"), ("virtual", "tap /run/hall-can0.frames")]
)
def test_frames_are_heard_on_the_interface_or_at_the_tap(interface: str, place: str) -> None:
    assert net(interface).frames == place


def test_its_version_is_that_of_the_protocol_and_of_the_bridge() -> None:
    """CiA 309-3: vendor, product, revision, serial number, class, protocol, implementation."""
    version = ".".join(__version__.split(".")[:2])
    assert net().version == f"0 0 {version} 0 1 3.00 {version}"
