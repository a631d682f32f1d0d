"""``drivebridge faults``: from a number on a display to what to do."""

from __future__ import annotations

import itertools
import json

import pytest
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed
from bridge.cli.app import make_app
from bridge.cli.faults_command import matching
from bridge.drive.fault_words import Language
from bridge.mapping import load_family
from bridge.mapping.loader import family_names

DEMO = "bridge/demo/site.toml"


def run(*arguments: str) -> str:
    result = CliRunner().invoke(make_app("faults"), ["faults", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.parametrize(
    ("family", "asked", "first"),
    [
        ("nord/sk-tu4-cao", "3.0", "E003/3.0 overcurrent of the inverter"),
        ("nord/sk-tu4-cao", "E010/10.3", "E010/10.3 time-out by P151/P513"),
        ("lenze/8400-motec", "02.0127.00002", "xx.0127.00002 CE04"),
        ("lenze/8400-motec", "8130h", "8130h life guarding error"),
        ("stoeber/5000", "41", "41 temperature of the motor, sensor"),
        ("stoeber/5000", "52.1", "52.1 communication: life guarding"),
        ("cia402/velocity", "8611h", "8611h following error"),
    ],
)
def test_a_number_is_found_as_the_display_shows_it(family: str, asked: str, first: str) -> None:
    name, found, *rest = run(family, asked).splitlines()
    assert name == family
    assert found.strip().startswith(first)
    assert all(line.startswith("      ") for line in rest), "it is the only one"


@pytest.mark.landing(6)
@pytest.mark.parametrize("name", sorted(set(family_names()) - {"generic/device"}))
def test_every_code_of_an_emergency_message_is_known(name: str) -> None:
    """Each code as the bus and the manual have it, also where the drive's own number says more (BU 2500
    §8.3.3)."""
    family = load_family(name)
    codes = [code for code in family.emcy.codes if "xx" not in code and int(code, 16)]
    lost: list[str] = []
    forms = itertools.cycle((str, "{}h".format, lambda code: f"0x{code.lower()}"))
    languages: itertools.cycle[Language] = itertools.cycle(("en", "de"))
    for code, form, language in zip(codes, forms, languages, strict=False):
        found = matching(family, form(code), language)
        known = [one for one in found if one.number == f"{code}h" and one.text and one.cause]
        lost += [] if len(found) == len(known) == 1 else [f"{form(code)} {language}: {found}"]
    assert not lost


def test_a_code_is_in_german_where_the_drives_number_is() -> None:
    assert "4310h 2.0/2.1 Übertemperatur Motor" in run("nord/sk-tu4-cao", "4310", "--language", "de")
    assert "4310h 2.0/2.1 overtemperature of the motor, I²t" in run("nord/sk-tu4-cao", "4310")


def test_a_part_of_a_text_finds_all_that_have_it() -> None:
    found = run("nord/sk-tu4-cao", "overcurrent")
    assert [line.split()[0] for line in found.splitlines() if line.startswith("  E")] == [
        *("E003/3.0", "E003/3.1", "E003/3.2", "E003/3.3", "E004/4.0", "E004/4.1")
    ]


def test_in_german() -> None:
    assert "Stromversorgung der Busschnittstelle prüfen." in run(
        "nord/sk-tu4-cao", "10.4", "--language", "de"
    )


def test_a_site_has_the_faults_of_all_its_families() -> None:
    told = json.loads(run(DEMO, "--json"))
    assert set(told) >= {"nord/sk-tu4-cao", "lenze/8400-motec", "stoeber/5000"}
    (one,) = [one for one in told["nord/sk-tu4-cao"] if one["number"] == "102.0"]
    assert one["cause"].startswith("The field bus brought")


def test_what_is_not_there_is_said() -> None:
    with pytest.raises(OperationFailed, match=r"no fault '77\.7'"):
        run("nord/sk-tu4-cao", "77.7")
    result = CliRunner().invoke(make_app("faults"), ["faults", "nord/none"])
    assert result.exit_code == 2
    assert "neither a site file nor one of" in result.output.replace("\n", " ")
