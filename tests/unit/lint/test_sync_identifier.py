"""A synchronous PDO of a node that waits for another SYNC than the bridge's takes no stop over: a table over
all families, and all names that 1005h has in them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config.download import Download
from bridge.lint import Severity, lint
from bridge.mapping import load_family
from bridge.mapping.alias_places import aliases
from bridge.mapping.loader import family_names, mapping_folders
from bridge.project import load_project
from tests.support import sites

FAMILIES = list(family_names(mapping_folders(Path("site.toml"))))
NAMES = [(name, "1005:00", True) for name in FAMILIES] + [
    (name, str(alias.ref), alias.is_same)
    for name in FAMILIES
    for alias in aliases(load_family(name))
    if (0x1005, 0) in [(ref.index, ref.sub) for ref in alias.objects]
]
SYNCHRONOUS, NOT_SYNCHRONOUS = "transmission_type = 1", "transmission_type = 255"


def judge(
    folder: Path, mapping: str, kind: str, node: str = "", downloads: tuple[Download, ...] = ()
) -> dict[Severity, list[str]]:
    """Findings on 1005h, by severity."""
    family = load_family(mapping)
    slot = family.slot[0]
    pdos = "\n".join(
        f"{name} = [{', '.join(f'{{ number = {pdo.number}, {kind} }}' for pdo in own if not pdo.optional)}]"
        for name, own in (("rpdo", slot.rpdo), ("tpdo", slot.tpdo))
    )
    whole = sites.node(sites.drive(slot.name, "modbus", 200, pdos), name="n", mapping=mapping, more=node)
    path = sites.write(folder, sites.bus(whole), sites.modbus())
    project = load_project(path)
    verdict = lint(project.site, project.families, path, {"n": downloads})
    said = {one: [str(found) for found in verdict.of(one)] for one in (Severity.ERROR, Severity.WARNING)}
    return {
        one: [text for text in texts if "SYNC" in text and "1005h" in text] for one, texts in said.items()
    }


def configure(name: str, value: int) -> str:
    return f'configure = [{{ object = "{name}", type = "uint32", value = {value} }}]'


OTHERS = [(*one, 0xC8) for one in NAMES]
OTHERS += [("lenze/8400-motec", "5E90:00", True, value) for value in (0x4000_0080, 0x2000_0080, 0)]


@pytest.mark.landing(38)
@pytest.mark.parametrize(("mapping", "name", "is_same", "value"), OTHERS)
def test_another_identifier_than_the_bridges_is_a_fault(
    tmp_path: Path, mapping: str, name: str, is_same: bool, value: int
) -> None:
    said = judge(tmp_path, mapping, SYNCHRONOUS, configure(name, value))
    (found,) = said[Severity.ERROR if is_same else Severity.WARNING]
    assert not said[Severity.WARNING if is_same else Severity.ERROR]
    assert "the bridge's SYNC is 80h" in found
    assert "configure[0]" in found


@pytest.mark.landing(26)
@pytest.mark.parametrize("value", [0x80, 0x8000_0080])
@pytest.mark.parametrize(("mapping", "name"), [one[:2] for one in NAMES if one[1] != "1005:00"])
def test_the_bridges_own_is_none(tmp_path: Path, mapping: str, name: str, value: int) -> None:
    assert not any(judge(tmp_path, mapping, SYNCHRONOUS, configure(name, value)).values())


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", FAMILIES)
def test_it_says_nothing_of_factory_settings(tmp_path: Path, mapping: str) -> None:
    assert not any(judge(tmp_path, mapping, SYNCHRONOUS).values())


def test_without_a_synchronous_pdo_nothing_waits_for_it(tmp_path: Path) -> None:
    node = configure("1005:00", 0xC8)
    assert not any(judge(tmp_path, "nord/sk-tu4-cao", NOT_SYNCHRONOUS, node).values())


def test_what_a_configuration_file_downloads_counts(tmp_path: Path) -> None:
    downloads = (Download(0x1005, 0, (0xC8).to_bytes(4, "little")),)
    (found,) = judge(tmp_path, "nord/sk-tu4-cao", SYNCHRONOUS, downloads=downloads)[Severity.ERROR]
    assert "1005h:00 = C8h" in found
