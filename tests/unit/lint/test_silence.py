"""Silence is a stop only where the drive watches its own process data (shared design, "When a stop is not
enough"): a table over all families and slots."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.lint import Severity, lint
from bridge.mapping import load_family
from bridge.mapping.loader import family_names, mapping_folders
from bridge.project import load_project
from tests.support import sites

FAMILIES = list(family_names(mapping_folders(Path("site.toml"))))
ON = "own_timeout_ms = 300\nenforce = true"
WATCHES_ITS_PROCESS_DATA = {"nord": True, "lenze": True, "stoeber": False, "cia402": False}
"""NORD: P151 of an interface, P513 of a node without one (BU 2500 §7.1.1, §8.1). Lenze: C00357 (§10.1).
STÖBER: life guarding alone (§9.4). CiA 402: heartbeat and life guarding (CiA 301 §7.5.2.17, .11)."""
SLOTS = [(name, slot.name) for name in FAMILIES for slot in load_family(name).slot]
SILENT = ('on_expiry = "silence"', "then_silence_ms = 100")


def site(folder: Path, mapping: str, *drives: tuple[str, str], node: str = "") -> Path:
    """Drives are slots and what else their tables have."""
    tables = [sites.drive(slot, "modbus", 200, more) for slot, more in drives]
    whole = sites.node(*tables, name="n", mapping=mapping, more=node)
    return sites.write(folder, sites.bus(whole), sites.modbus())


def faults(path: Path) -> list[str]:
    try:
        load_project(path)
    except FileFaults as error:
        assert all(fault.line > 0 for fault in error.faults)
        return [str(fault) for fault in error.faults]
    return []


def node_of(mapping: str, *slots: str) -> str:
    """A node whose drives watch their process data where they can, all of them reached by SDO."""
    if not WATCHES_ITS_PROCESS_DATA[mapping.partition("/")[0]]:
        return ""
    channels = channels_to(mapping, *slots)
    return f"{ON}\nsdo_channels = {channels}" if channels else ON


def channels_to(mapping: str, *slots: str) -> list[int]:
    """The SDO servers of these drives beside the first one."""
    family = load_family(mapping)
    hidden = [slot for slot in slots if not family.slot_named(slot).parameters_by_sdo]
    return [server.number for server in family.sdo if server.slot in hidden]


def has_hidden_reaction(mapping: str, slot: str) -> bool:
    """Whether the drive's own watch has a part that the first SDO server does not reach."""
    family = load_family(mapping)
    first = next(entry for entry in family.own_supervision if entry.watches == "process_data")
    is_of_drive = first.per_drive or (first.reaction is not None and first.reaction.per_drive)
    return is_of_drive and not family.slot_named(slot).parameters_by_sdo


@pytest.mark.landing(3)
@pytest.mark.parametrize("silent", SILENT)
@pytest.mark.parametrize(("mapping", "slot"), SLOTS)
def test_it_is_taken_where_the_drive_watches_its_own_process_data(
    tmp_path: Path, mapping: str, slot: str, silent: str
):
    told = faults(site(tmp_path, mapping, (slot, silent), node=node_of(mapping, slot)))
    if WATCHES_ITS_PROCESS_DATA[mapping.partition("/")[0]]:
        assert not told
        return
    (fault,) = told
    assert silent.partition(" ")[0] in fault
    assert "silence does not stop this drive" in fault
    assert "site.toml:" in fault


WATCHING = [(name, slot) for name, slot in SLOTS if WATCHES_ITS_PROCESS_DATA[name.partition("/")[0]]]


@pytest.mark.landing(3)
@pytest.mark.parametrize("silent", SILENT)
@pytest.mark.parametrize(("mapping", "slot"), WATCHING)
def test_what_is_enforced_counts_only_where_an_sdo_channel_reaches_it(
    tmp_path: Path, mapping: str, slot: str, silent: str
):
    """P513 of fu2 may be -0.1 (ignore), and over the first channel nobody reads or writes it."""
    told = faults(site(tmp_path, mapping, (slot, silent), node=ON))
    if not has_hidden_reaction(mapping, slot):
        assert not told
        return
    (fault,) = told
    assert "silence does not stop this drive: P513 is not known" in fault
    assert f"sdo_channels = {channels_to(mapping, slot)}" in fault


@pytest.mark.landing(17)
@pytest.mark.parametrize("is_open", [True, False])
@pytest.mark.parametrize(("mapping", "slot"), WATCHING)
def test_a_dead_bridge_is_not_known_of_what_cannot_be_reached(
    tmp_path: Path, mapping: str, slot: str, is_open: bool
):
    path = site(tmp_path, mapping, (slot, ""), node=node_of(mapping, slot) if is_open else ON)
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    (case,) = verdict.worst_cases
    warnings = [str(one) for one in verdict.of(Severity.WARNING) if "may run on" in str(one)]
    if is_open or not has_hidden_reaction(mapping, slot):
        assert "dead bridge: 400 ms" in str(case)
        assert not warnings
        return
    assert "dead bridge: not known" in str(case)
    (warning,) = warnings
    assert f"sdo_channels = {channels_to(mapping, slot)}" in warning


@pytest.mark.parametrize("silent", SILENT)
@pytest.mark.parametrize("mapping", [name for name in FAMILIES if len(load_family(name).slot) > 1])
def test_it_is_refused_where_drives_share_a_watch(tmp_path: Path, mapping: str, silent: str):
    """NORD's P151 is the interface's: the RPDOs of fu1 keep it quiet for fu2."""
    first, second, *_ = (slot.name for slot in load_family(mapping).slot)
    node = node_of(mapping, first, second)
    (fault,) = faults(site(tmp_path, mapping, (first, ""), (second, silent), node=node))
    if node_of(mapping):
        assert "watches the RPDOs of all 2 drives of the node" in fault


@pytest.mark.parametrize("supervision", ['supervision = "guarding"', 'supervision = "heartbeat"'])
@pytest.mark.parametrize(
    "mapping", ["stoeber/5000", "cia402/velocity", "nord/sk-tu4-cao", "lenze/8400-motec"]
)
def test_neither_guarding_nor_heartbeat_makes_it_a_stop(tmp_path: Path, mapping: str, supervision: str):
    slot = load_family(mapping).slot[0].name
    heartbeat = '\nconfigure = [{ object = "1016:01", type = "uint32", value = 8323372 }]'  # node 127, 300 ms
    node = supervision + (heartbeat if mapping.startswith(("cia402", "lenze")) else "")
    (fault,) = faults(site(tmp_path, mapping, (slot, SILENT[0]), node=node))
    assert "silence does not stop this drive" in fault


def test_a_watch_that_is_off_or_not_known_is_none(tmp_path: Path):
    for mapping, reason in (
        ("nord/sk-tu4-cao", "P151 is 0 (off)"),
        ("nord/sk-tu3-cao", "P513 is not known"),
        ("lenze/8400-motec", "it runs on"),
    ):
        slot = load_family(mapping).slot[0].name
        (fault,) = faults(site(tmp_path, mapping, (slot, SILENT[0])))
        assert reason in fault
        assert "own_timeout_ms and enforce = true" in fault


def test_both_keys_of_all_drives_are_told_in_one_go(tmp_path: Path):
    both = "\n".join(SILENT)
    told = faults(site(tmp_path, "cia402/velocity", ("drive", both)))
    assert len(told) == 2


@pytest.mark.landing(13)
@pytest.mark.parametrize("mapping", [name for name in FAMILIES if node_of(name)])
def test_the_published_time_has_the_drives_own_in_it(tmp_path: Path, mapping: str):
    def worst_ms(drive: str) -> int:
        slot = load_family(mapping).slot[0].name
        path = site(tmp_path, mapping, (slot, drive), node=ON)
        project = load_project(path)
        (case,) = lint(project.site, project.families, path, project.downloads).worst_cases
        return case.stop.ms

    assert worst_ms(SILENT[0]) == worst_ms("") + 300
    assert worst_ms(SILENT[1]) == worst_ms("")


@pytest.mark.landing(37)
@pytest.mark.parametrize(("mapping", "slot"), SLOTS)
def test_silence_after_hold_is_refused_since_it_never_comes(tmp_path: Path, mapping: str, slot: str):
    held = 'on_expiry = "hold"\nthen_silence_ms = 100'
    for node in {"", node_of(mapping, slot)}:
        (fault,) = faults(site(tmp_path, mapping, (slot, held), node=node))
        assert "then_silence_ms" in fault
        assert 'has no effect with on_expiry = "hold"' in fault
        assert "does not stop" not in fault
    assert not faults(site(tmp_path, mapping, (slot, 'on_expiry = "hold"')))
