"""Mapping files that extend others, and those in a folder of the site."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import family_names, load_family
from bridge.mapping.loader import mapping_folders, mappings_dir
from bridge.mapping.site_families import load_site_and_families
from tests.support.invented import NAME, SPIN
from tests.support.mapping_folder import BASE, Folder

VARIANT = """\
extends = "acme/base"
[family]
name = "Spin 4000"
[[value]]
name = "speed"
group = "actual"
unit = "Hz"
[[value]]
name = "temperature"
group = "actual"
word = "modes_now"
unit = "°C"
[[parameter]]
name = "P90"
title = "fault now"
[faults.texts]
"9.9" = "new"
"""


class TestExtends:
    def test_tables_are_merged_and_named_items_too(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT)
        spin = folder.load("acme/4000")
        assert (spin.family.name, spin.family.vendor, spin.family.template) == ("Spin 4000", "Acme", False)
        speed = next(value for value in spin.value if value.leaf == "actual/speed")
        assert (speed.unit, speed.full) == ("Hz", "P7")
        assert spin.value[-1].name == "temperature"
        assert spin.parameter_named("P90").title == "fault now"
        assert spin.parameter_named("P90").factor == 0.1
        assert spin.faults.texts == {"1.0": "controller silent", "7.2": "spindle too hot", "9.9": "new"}

    def test_what_is_said_anew_has_no_german_of_before(self, folder: Folder) -> None:
        own = '[[parameter]]\nname = "P90"\n'
        german = 'german = "Anliegende Störung"\nstates = { 0 = "none" }\ngerman_states = { 0 = "keine" }\n'
        folder.add("acme/german", f'extends = "acme/base"\n{own}{german}')
        found = {}
        for name, more in {
            "same": 'unit = "x"\n',
            "titled": 'title = "fault now"\n',
            "both": 'title = "fault now"\ngerman = "Jetzige Störung"\n',
            "stated": 'states = { 9 = "hot" }\n',
        }.items():
            folder.add(f"acme/{name}", f'extends = "acme/german"\n{own}{more}')
            one = folder.load(f"acme/{name}").parameter_named("P90")
            found[name] = (one.german, one.german_states)
        assert found == {
            "same": ("Anliegende Störung", {0: "keine"}),
            "titled": ("", {0: "keine"}),
            "both": ("Jetzige Störung", {0: "keine"}),
            "stated": ("Anliegende Störung", {}),
        }

    def test_a_value_of_the_other_group_is_another_one(self, folder: Folder) -> None:
        more = '[[value]]\nname = "speed"\ngroup = "command"\nword = "modes"\n'
        text = (
            SPIN.replace('"speed", "target_low"', '"speed_set", "target_low"')
            .replace('["control_word", "speed"]', '["control_word", "speed_set"]')
            .replace('word = "speed"\n', 'word = "speed_set"\n')
        )
        folder.add("acme/base", text)
        folder.add("acme/4000", f'extends = "acme/base"\n{more}')
        assert {value.leaf for value in folder.load("acme/4000").value} >= {"actual/speed", "command/speed"}

    def test_other_lists_are_replaced(self, folder: Folder) -> None:
        folder.add("acme/4000", 'extends = "acme/base"\n[control_word]\nbits = ["one"]\n')
        assert folder.load("acme/4000").control_word.bits == ["one"]

    def test_a_slot_gets_other_pdos(self, folder: Folder) -> None:
        pdo = '[slot.rpdo]\nnumber = 4\ncob_id = 0x500\nwords = ["control_word"]\nobjects = [["6040:00"]]\n'
        folder.add("acme/4000", f'extends = "acme/base"\n[[slot]]\nname = "axis"\n{pdo}')
        spin = folder.load("acme/4000")
        assert [one.number for one in spin.slot[0].rpdo] == [4]
        assert len(spin.slot[0].tpdo) == 3
        assert [value.name for value in spin.values_of(spin.slot[0]) if value.group == "command"] == []

    def test_one_setting_of_a_pdo_is_changed_by_its_number(self, folder: Folder) -> None:
        head = 'extends = "acme/base"\n[[slot]]\nname = "axis"\n'
        folder.add("acme/4000", f"{head}[[slot.tpdo]]\nnumber = 2\nevent_ms = 20\n")
        slot = folder.load("acme/4000").slot[0]
        assert [one.number for one in slot.tpdo] == [1, 2, 3]
        assert (slot.tpdo[1].event_ms, slot.tpdo[1].cob_id, slot.tpdo[1].write) == (20, 0x280, True)
        folder.add("acme/4000", f"{head}[slot.rpdo]\ncob_id = 0x220\n")
        slot = folder.load("acme/4000").slot[0]
        assert [(one.number, one.cob_id) for one in slot.rpdo] == [(1, 0x220), (2, 0x300), (3, 0x400)]

    def test_a_fault_in_a_pdo_that_is_changed_has_its_line(self, folder: Folder) -> None:
        text = 'extends = "acme/base"\n[[slot]]\nname = "axis"\n[[slot.tpdo]]\nnumber = 2\nevent_ms = -1\n'
        folder.add("acme/4000", text)
        assert folder.told("acme/4000")[0].startswith("acme/4000.toml:6: slot[0].tpdo[0].event_ms: must be")

    def test_a_single_pdo_and_a_list_are_one(self, folder: Folder) -> None:
        head = 'extends = "cia402/velocity"\n[[slot]]\nname = "drive"\n'
        base = f"{head}[[slot.tpdo]]\nnumber = 1\nevent_ms = 50\n"
        folder.add("acme/fan", base)
        (pdo,) = folder.load("acme/fan").slot[0].tpdo
        assert (pdo.event_ms, pdo.cob_id, pdo.inhibit_ms) == (50, 0x180, 10.0)
        folder.add("acme/fan", base.replace("[[slot.tpdo]]\nnumber = 1", "[slot.tpdo]"))
        assert folder.load("acme/fan").slot[0].tpdo == [pdo]

    def test_what_a_variant_has_not_is_left_out(self, folder: Folder) -> None:
        without = '["value:command/valve_b", "value:actual/probes", "parameter:P90"]'
        more = '[[value]]\nname = "in_position"\ngroup = "actual"\nbit = 99\n'
        folder.add("acme/base", BASE.replace('current = { parameter = "P90" }\n', ""))
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n')
        spin = folder.load("acme/4000")
        leaves = {value.leaf for value in spin.value}
        assert "command/valve_a" in leaves
        assert leaves.isdisjoint({"command/valve_b", "actual/probes"})
        assert [one.name for one in spin.parameter] == ["P7", "P91"]
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n{more}')
        assert folder.told("acme/4000")[0].startswith("acme/4000.toml:6: value[0].bit: must be")
        folder.add("acme/5000", 'extends = "acme/4000"\nwithout = []\n')
        folder.add("acme/4000", f'extends = "acme/base"\nwithout = {without}\n')
        assert [one.name for one in folder.load("acme/5000").parameter] == ["P7", "P91"]

    def test_what_is_left_out_must_be_there(self, folder: Folder) -> None:
        folder.add("acme/4000", 'extends = "acme/base"\nwithout = ["parameter:P5", "pdo:2"]\n')
        first, second = folder.told("acme/4000")
        assert "acme/4000.toml:2: without[0]: there is no 'parameter:P5'" in first
        assert "known: P7, P90, P91" in first
        assert "it is one of value, meaning, parameter, poll, slot, input, own_supervision" in second
        folder.add("acme/4000", 'extends = "acme/base"\nwithout = ["parameter:P7"]\n')
        assert "there is no parameter 'P7'" in folder.told("acme/4000")[0]

    def test_a_fault_is_told_with_the_file_where_it_stands(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT.replace('word = "modes_now"', 'word = "modes_then"'))
        assert folder.told("acme/4000")[0].startswith(
            "acme/4000.toml:11: value[1].word: there is no value word 'modes_then'"
        )
        folder.add("acme/4000", VARIANT)
        folder.add("acme/base", BASE.replace('word = "speed_now"', 'word = "speed_then"'))
        line = BASE[: BASE.index('word = "speed_now"')].count("\n") + 1
        assert folder.told("acme/4000")[0].startswith(
            f"acme/base.toml:{line}: value[0].word: there is no value word 'speed_then'"
        )

    def test_what_is_missing_is_missing_in_the_file_that_extends(self, folder: Folder) -> None:
        folder.add("acme/base", BASE.replace('vendor = "Acme"\n', ""))
        folder.add("acme/4000", VARIANT)
        assert folder.told("acme/4000")[0] == "acme/4000.toml:2: family.vendor: is missing"

    def test_three_files_in_a_row(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT)
        folder.add("acme/5000", 'extends = "acme/4000"\n[family]\nname = "Spin 5000"\n')
        spin = folder.load("acme/5000")
        assert (spin.family.name, spin.value[-1].name) == ("Spin 5000", "temperature")

    def test_a_circle_is_told(self, folder: Folder) -> None:
        folder.add("acme/a", 'extends = "acme/b"\n')
        folder.add("acme/b", 'extends = "acme/a"\n')
        assert "extends: 'acme/a' extends this file in its turn" in folder.told("acme/a")[0]
        folder.add("acme/c", 'extends = "acme/c"\n')
        assert "acme/c.toml:1: extends: extends itself" in folder.told("acme/c")[0]

    def test_one_that_is_not_there_is_told_with_what_is(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT.replace("acme/base", "acme/bass"))
        (told,) = folder.told("acme/4000")
        assert told.startswith(
            "acme/4000.toml:1: extends: there is no mapping 'acme/bass' (there are: acme/4000"
        )
        assert "acme/base" in told

    def test_twice_in_one_file_is_twice(self, folder: Folder) -> None:
        folder.add("acme/4000", VARIANT + '[[parameter]]\nname = "P90"\n')
        told = folder.told("acme/4000")
        assert any("parameter[1]" in line for line in told)

    def test_a_file_of_the_site_may_extend_the_one_that_comes_with_the_program(self, folder: Folder) -> None:
        name = "nord/sk-tu4-cao"
        folder.add(name, f'extends = "{name}"\n[family]\nnode_id_high = 9\n')
        assert folder.load(name).family.node_id_high == 9
        assert load_family(name).family.node_id_high == 63

    def test_a_template_is_for_no_site(self, folder: Folder) -> None:
        folder.add(NAME, BASE)
        assert NAME not in family_names(mapping_folders(folder.site))
        with pytest.raises(FileFaults) as caught:
            load_site_and_families(folder.site)
        (fault,) = caught.value.faults
        assert (fault.line, fault.key) == (9, "bus[0].node[0].mapping")
        assert fault.message == "'acme/spin' is a template: it can only be extended"


class TestOwnFolder:
    def test_the_folder_beside_the_site_file_comes_first(self, folder: Folder) -> None:
        folder.add(NAME, SPIN)
        _, families = load_site_and_families(folder.site)
        assert families[NAME].family.name == "Spin 3000"
        assert mapping_folders(folder.site) == (folder.top / "mappings", mappings_dir())
        assert "nord/sk-tu4-cao" in family_names(mapping_folders(folder.site))

    def test_its_faults_come_with_those_of_the_site(self, folder: Folder) -> None:
        path = folder.add(NAME, SPIN.replace("acknowledge_bit = 7", "acknowledge_bit = 77"))
        with pytest.raises(FileFaults) as caught:
            load_site_and_families(folder.site)
        (fault,) = caught.value.faults
        assert (fault.file, fault.key) == (str(path), "control_word.acknowledge_bit")
