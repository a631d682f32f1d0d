"""NMT for all nodes of a bus by zenoh: ``…/bus/<bus>/<command>``."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.catalogue import Catalogue
from bridge.command import Action, Identity, Plant, Source
from bridge.northbound.zenoh.commands import BUS_METHODS, BadCommand, Commands
from tests.support.quick import MAPPING, NORD, quick_site

WHO = Identity(Source.ZENOH, "plc")


@pytest.fixture
def commands(tmp_path: Path) -> Commands:
    return Commands(Plant(Catalogue.of(quick_site(tmp_path, 2), {MAPPING: NORD}), "0").image.points)


@pytest.mark.parametrize("action", BUS_METHODS)
def test_a_bus_takes_the_five_commands_of_nmt(commands: Commands, action: Action) -> None:
    tail = f"bus/can0/{action}"
    assert commands.is_method(tail)
    request = commands.request(tail, b"{}", WHO)
    assert (request.target, request.action) == ("bus/can0", action)
    assert len(BUS_METHODS) == 5


@pytest.mark.parametrize("tail", ["bus/can0/disable", "bus/can1/stop_node", "bus/can0/state"])
def test_what_a_bus_does_not_take_is_no_command(commands: Commands, tail: str) -> None:
    assert not commands.is_method(tail)
    with pytest.raises(BadCommand):
        commands.request(tail, b"{}", WHO)


def test_a_node_takes_them_as_before(commands: Commands) -> None:
    request = commands.request("n1/node/stop_node", b"{}", WHO)
    assert (request.target, request.action) == ("n1", Action.STOP_NODE)
