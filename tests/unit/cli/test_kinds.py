"""Words of the command line for a drive and for outputs: one row for each kind of member."""

from __future__ import annotations

from pathlib import Path

from bridge.cli.kinds import words_of
from tests.support import sites
from tests.support.devices import IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant


def test_a_drive_runs_on_and_outputs_are_kept(tmp_path: Path) -> None:
    site = sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0, ""))))
    (drive,) = sites.catalogue_of(site).members.values()
    (block,) = device_plant(tmp_path, IO_BLOCK, OUTPUTS).catalogue.members.values()
    assert (words_of(drive).runs_on, words_of(block).runs_on) == ("run on", "keep its outputs")
    told = words_of(block).drop_test.format(node="shaft", id=20)
    assert told.startswith("shaft (id 20) is booted, its outputs get their safe values")
    assert words_of(drive).drop_test.format(node="conveyor", id=5).startswith("The drives of conveyor (id 5)")
