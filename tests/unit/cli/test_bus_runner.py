"""The bus that a command means: by options, by a site file, by neither."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

from bridge.bustools.single import SdoTask
from bridge.canopen.frame import Frame
from bridge.cli.bus_runner import BusChoice, choose_bus, split_site


def test_a_bus_is_named_by_its_options() -> None:
    line = choose_bus(None, BusChoice(None, "socketcan", "can0", 500_000))
    assert (line.table.channel, line.table.bitrate, line.is_of_site) == ("can0", 500_000, False)


def test_a_site_with_two_buses_needs_the_name_of_one(site: Path) -> None:
    with pytest.raises(typer.BadParameter, match="one of north, south"):
        choose_bus(site, BusChoice())
    line = choose_bus(site, BusChoice("north"))
    assert line.node_id("conveyor") == 5
    assert line.node_id("0x11") == 17
    with pytest.raises(typer.BadParameter, match="conveyor"):
        line.node_id("conveior")


@pytest.mark.parametrize(
    ("bus", "interface", "channel"),
    [(None, None, None), ("can0", None, None), (None, "socketcan", None), (None, "virtual", "x")],
)
def test_half_a_bus_is_bad_usage(bus: str | None, interface: str | None, channel: str | None) -> None:
    with pytest.raises(typer.BadParameter):
        choose_bus(None, BusChoice(bus, interface, channel))


def test_a_site_and_an_interface_are_two_buses(site: Path) -> None:
    with pytest.raises(typer.BadParameter, match="leave the options out"):
        choose_bus(site, BusChoice("north", "socketcan", "can0"))


def test_the_site_may_stand_first() -> None:
    assert split_site(["5", "1000"], 2, "") == (None, ["5", "1000"])
    assert split_site(["a.toml", "5", "1000"], 2, "") == (Path("a.toml"), ["5", "1000"])
    with pytest.raises(typer.BadParameter):
        split_site(["5"], 2, "usage")


def test_a_nodes_own_time_and_retries_are_taken_from_the_site(site: Path) -> None:
    text = site.read_text("utf-8").replace("id = 5", "id = 5\nsdo_timeout_ms = 700\nsdo_retries = 3")
    site.write_text(text, "utf-8")
    line = choose_bus(site, BusChoice("north"))
    assert line.sdo_policy(5) == (0.7, 3)
    assert line.sdo_policy(6) == (0.5, 0), "a node that the site does not have"


def test_a_further_sdo_channel_has_the_cob_ids_of_the_mapping(site: Path) -> None:
    """BU 2500 §6.4: SDO3 is 440h and 3C0h + node id."""
    line = choose_bus(site, BusChoice("north"))
    assert line.sdo_server(5, 1) is None
    server = line.sdo_server(5, 3)
    assert server is not None
    task = SdoTask(5, 0x2069, 1, None, 10.0, 0.5, server=server)
    assert [frame.can_id for frame in task.take_frames()] == [0x445]
    task.on_frame(Frame(0x3C5, bytes.fromhex("4B692001F4010000"), 10.1))
    assert task.result == b"\xf4\x01"
    with pytest.raises(typer.BadParameter, match="no SDO channel 9: 1, 2, 3, 4"):
        line.sdo_server(5, 9)
    with pytest.raises(typer.BadParameter, match="give SITE"):
        choose_bus(None, BusChoice(None, "socketcan", "can0")).sdo_server(5, 2)
