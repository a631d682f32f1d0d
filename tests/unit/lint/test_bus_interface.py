"""A bus whose frames anybody on a network may send is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import lint
from bridge.project import load_project
from tests.support import sites


def findings(folder: Path, interface: str, channel: str) -> list[str]:
    bus = sites.bus(
        sites.node(sites.drive("fu1", "modbus", 200)), interface=interface, more=f'channel = "{channel}"'
    )
    project = load_project(sites.write(folder, bus, sites.modbus()))
    found = lint(project.site, project.families, project.path, project.downloads).findings
    return [one.fault.message for one in found if one.fault.key == "bus[0].interface"]


@pytest.mark.parametrize(
    ("interface", "channel"), [("udp_multicast", "239.74.163.2"), ("socketcand", "can0")]
)
def test_frames_that_come_over_a_network_are_a_warning(tmp_path: Path, interface: str, channel: str) -> None:
    (message,) = findings(tmp_path, interface, channel)
    assert message.startswith("frames come over the network")


@pytest.mark.parametrize(("interface", "channel"), [("socketcan", "can0"), ("pcan", "PCAN_USBBUS1")])
def test_a_can_interface_of_the_machine_is_none(tmp_path: Path, interface: str, channel: str) -> None:
    assert findings(tmp_path, interface, channel) == []
