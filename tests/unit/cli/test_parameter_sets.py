"""Files of parameter sets on the command line, without a drive."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from bridge.base.errors import FileFaults
from bridge.cli.app import make_app
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.parameter import Names, ObjectRef
from bridge.parameter.codec import decode
from bridge.parameter.factory import described, factory

SITE = """
[site]
name = "hall3"
[[bus]]
name = "can0"
interface = "socketcan"
channel = "can0"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
"""
FILE = 'format = 2\nmapping = "nord/sk-tu4-cao"\n[parameters]\n"P102.1" = {}\n[objects]\n"P203.1" = 11\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "site.toml").write_text(SITE, "utf-8")
    (tmp_path / "monday.toml").write_text(FILE.format(2.0), "utf-8")
    (tmp_path / "fu1.toml").write_text(FILE.format(1.5), "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def compare(*arguments: str) -> Result:
    words = ["parameters", "compare", "site.toml", "conveyor/fu1", *arguments]
    return CliRunner().invoke(make_app("parameters"), words)


@pytest.mark.usefixtures("folder")
def test_two_files_are_compared_without_a_bus() -> None:
    done = compare("fu1.toml", "--with", "monday.toml")
    assert done.exit_code == 1
    assert done.output.splitlines() == [
        "name    in monday.toml  in the file",
        "P102.1  2 s             1.5 s",
        "conveyor/fu1: 1 differ, 1 are the same",
    ]
    same = compare("fu1.toml", "--with", "fu1.toml", "--json")
    assert (same.exit_code, json.loads(same.output)["ok"]) == (0, True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('"nord/sk-tu4-cao"', '"lenze/8400-motec"'),
            "fu1.toml:2: mapping: the file is of lenze/8400-motec, and conveyor/fu1 has nord/sk-tu4-cao",
        ),
        (('"P203.1" = 11', '"P203.1" = '), "fu1.toml:6: is not TOML"),
        (('"P203.1" = 11', '"P102.1" = 1.5'), 'fu1.toml:6: objects."P102.1": stands in [parameters], too'),
        (('"P203.1" = 11', '"P102" = 1.5'), "fu1.toml:6: P102: P102.1 and P102 are the same parameter"),
        (('"P203.1" = 11', '"P9999" = 1.5'), "fu1.toml:6: P9999: there is no parameter"),
        (('"P102.1" = 1.5', '"P102.1" = "fast"'), "fu1.toml:4: P102.1: P102.1 takes"),
        (('"P102.1" = 1.5', '"P102.1" = 1e9'), "fu1.toml:4: P102.1: P102.1 takes"),
    ],
)
def test_a_file_that_does_not_fit_is_named(folder: Path, change: tuple[str, str], message: str) -> None:
    text = (folder / "fu1.toml").read_text("utf-8").replace(*change)
    (folder / "fu1.toml").write_text(text, "utf-8")
    done = compare("fu1.toml", "--with", "monday.toml")
    said = " ".join((done.output + str(done.exception)).replace("│", " ").split())
    assert isinstance(done.exception, FileFaults)
    assert message in said


def test_an_eds_gives_the_factory_settings_and_what_there_is_to_read() -> None:
    names = Names(load_family("lenze/8400-motec"))
    file = mappings_dir() / "lenze" / "8400-motec.eds"
    settings = factory(file, names, 6)
    # 5A20h:01 has the default 200 in the file
    entry = names.at(ObjectRef(0x5A20, 1))
    assert settings[entry.name] == decode(entry, (200).to_bytes(4, "little"))
    assert entry.address in described(file, names)
    assert not any(names.protection.why_never(names.resolve(name)) for name in settings)
    assert min(place.index for place in described(file, names)) >= 0x2000


def test_an_eds_is_compared_with_but_not_restored(folder: Path) -> None:
    eds = str(mappings_dir() / "nord" / "sk-tu4-cao.eds")
    done = compare("fu1.toml", "--with", eds)
    assert isinstance(done.exception, FileFaults)
    assert "has no factory settings" in str(done.exception)
    words = ["parameters", "restore", str(folder / "site.toml"), "conveyor/fu1", eds]
    done = CliRunner().invoke(make_app("parameters"), words)
    assert done.exit_code == 2
    assert "is no backup" in " ".join(done.output.replace("│", " ").split())
