"""Parameters as the page lists them, and files of them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import NodeTable
from bridge.mapping.loader import family_names, load_family, mapping_folders
from bridge.northbound.page import parameter_page
from bridge.northbound.page.parameter_page import Holder, backup_of, holders_of, listed
from bridge.parameter import Names, backups
from bridge.parameter.backup_file import read_backup
from tests.support import sites

_SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "lease", 1000), sites.drive("fu2", "none", 0))))


def holders() -> dict[str, Holder]:
    return holders_of(sites.catalogue_of(_SITE))


def test_each_drive_has_its_parameters_with_range_states_and_wear() -> None:
    found = holders()
    assert set(found) == {"conveyor/fu1", "conveyor/fu2"}
    told = listed(
        found["conveyor/fu1"], {("conveyor/fu1", "2066:01"): 17, ("conveyor", "2066:02"): 9}, {"P102.1": 3.5}
    )
    by_name = {one["name"]: one for one in told["parameters"]}
    ramp = by_name["P102.1"]
    assert (ramp["low"], ramp["high"], ramp["unit"], ramp["writes"]) == (0, 320, "s", 17)
    assert ramp["setting"]
    assert by_name["P102.2"]["writes"] == 0
    assert ramp["factory"] == 3.5
    assert "factory" not in by_name["P102.2"]
    assert told["cycles"] == 100_000
    source = by_name["P509"]
    assert "protected" in source
    assert (source["title"], source["states"]["3"]) == ("source of the control word", "system bus")
    assert (source["german"], source["german_states"]["3"]) == ("Quelle Steuerwort", "Systembus")


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", family_names(mapping_folders()))
def test_the_parameters_of_every_family_can_be_listed(mapping: str) -> None:
    family = load_family(mapping)
    node = NodeTable.model_validate({"name": "one", "id": 5, "mapping": mapping})
    for on_first in (True, False):
        holder = Holder("one/drive", node, family, Names(family), on_first)
        told = listed(holder, {}, {})["parameters"]
        names = [one["name"] for one in told]
        assert len(set(names)) == len(names)
        settings = [entry.name for entry in backups.settings(holder.names, on_first=on_first)]
        assert [one["name"] for one in told if one.get("setting")] == settings
        assert not [one for one in told if one.get("setting") and one.get("why_never")]


def test_a_backup_of_the_page_is_one_that_the_command_line_reads(tmp_path: Path) -> None:
    holder = holders()["conveyor/fu1"]
    text = backup_of(
        holder,
        {"P102.1": 3.5, "P105.1": 60.0, "P700": 1, "nonsense": 4},
        ["P113.1"],
        {"P426.1": "not\nnow"},
        {"vendor": 0x38, "product": 1},
    )
    file = tmp_path / "fu1.toml"
    file.write_text(text, encoding="utf-8")
    found = read_backup(file)
    assert found.all == {"P102.1": 3.5, "P105.1": 60.0}, "what is no setting is in no set"
    assert found.identity == {"vendor": 0x38, "product": 1}
    assert "#   P113.1" in text
    assert "#   P426.1: not now" in text
    assert tomllib.loads(text)["mapping"] == holder.node.mapping


def test_a_file_is_read_in_the_order_of_the_mapping_and_faults_name_the_readers_file() -> None:
    holder = holders()["conveyor/fu1"]
    text = backup_of(holder, {"P105.1": 60.0, "P102.1": 3.5}, [], {}, {})
    assert list(parameter_page._read(text.encode(), "monday.toml", holder)["values"]) == ["P102.1", "P105.1"]
    for content, said in (
        (text.replace("P102.1", "P9999999.1"), "monday.toml:"),
        (text.replace("60.0", "6000.0"), "monday.toml:"),
        (text[: len(text) // 2], "monday.toml:"),
        (text.replace(holder.node.mapping, "lenze/8400-motec"), "the file is of lenze/8400-motec"),
        ("\x00", "monday.toml"),
    ):
        with pytest.raises(FileFaults, match=said):
            parameter_page._read(content.encode(), "monday.toml", holder)
