"""The linter and a drive that does nothing by itself at factory (EDS84DMOTCAN 3.0, §10.1)."""

from __future__ import annotations

import tomllib

import pytest

from bridge.config import Site
from bridge.lint import Severity, family_dictionaries, lint
from bridge.mapping import load_family

NAME = "lenze/8400-motec"
SITE = """
[site]
name = "lint"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "lenze/8400-motec"
configure = [{configure}]
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 200
[modbus]
"""
TIME = '{{ object = "5E9A:01", type = "uint16", value = {0} }}'
REACTION = '{{ object = "5DAE:01", type = "uint8", value = {0} }}'


def warnings(tmp_path, *configure: str) -> list[str]:
    """Warnings about the node's own reaction."""
    text = SITE.format(configure=", ".join(configure))
    path = tmp_path / "site.toml"
    path.write_text(text, encoding="utf-8")
    site = Site.model_validate(tomllib.loads(text))
    verdict = lint(site, {NAME: load_family(NAME)}, path, {}, family_dictionaries([NAME]))
    return [str(one) for one in verdict.of(Severity.WARNING) if "5DAE:01" in str(one)]


def test_a_site_that_sets_nothing_is_told_that_the_drive_runs_on(tmp_path):
    (warning,) = warnings(tmp_path)
    assert "8400 motec does nothing by itself when the bridge falls silent" in warning


def test_a_time_without_a_reaction_has_no_effect(tmp_path):
    (warning,) = warnings(tmp_path, TIME.format(300))
    assert "5E9A:01, has no effect: its reaction 5DAE:01 is not set, and none by factory setting" in warning


def test_a_reaction_that_is_none_is_said_too(tmp_path):
    (warning,) = warnings(tmp_path, TIME.format(300), REACTION.format(0))
    assert "its reaction 5DAE:01 is 0" in warning


@pytest.mark.parametrize("configure", [(TIME.format(300), REACTION.format(1)), (REACTION.format(0),)])
def test_nothing_is_said_where_the_site_has_decided(tmp_path, configure):
    assert not warnings(tmp_path, *configure)


def contradictions(tmp_path, configure: str) -> list[str]:
    text = SITE.format(configure=configure).replace('control = "modbus"', 'control = "modbus"\n' + OWN_PDOS)
    path = tmp_path / "site.toml"
    path.write_text(text, encoding="utf-8")
    site = Site.model_validate(tomllib.loads(text))
    verdict = lint(site, {NAME: load_family(NAME)}, path, {}, family_dictionaries([NAME]))
    return [str(one) for one in verdict.of(Severity.WARNING) if "the bridge sets" in str(one)]


OWN_PDOS = "rpdo = { cob_id = 0x285, transmission_type = 254 }"


@pytest.mark.parametrize(
    ("configure", "said"),
    [
        (
            '{ object = "5EBC:01", type = "uint8", value = 1 }',
            "5EBCh:01 (C00323/1), which is 1400h:02, = 1, and the bridge sets it to 254",
        ),
        (
            '{ object = "5E82:00", type = "uint16", value = 60000 }',
            "5E82h:00 (C00381), which is 1017h:00, = 60000, and the bridge sets it to 66",
        ),
        (
            '{ object = "5E9D:01", type = "uint32", value = 0x205 }',
            "5E9Dh:01 (C00354/1) decides 1400h:01, too, and the bridge sets that to 285h",
        ),
    ],
)
def test_a_download_to_another_name_of_an_object_is_compared_as_that(tmp_path, configure, said):
    (warning,) = contradictions(tmp_path, configure)
    assert said in warning


def test_a_download_that_says_the_same_under_another_name_is_fine(tmp_path):
    assert not contradictions(tmp_path, '{ object = "5EBC:01", type = "uint8", value = 254 }')
