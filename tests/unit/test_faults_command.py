"""``drivebridge faults``: from a number on a display to what to do."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from bridge.cli.app import make_app
from bridge.errors import OperationFailed

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
