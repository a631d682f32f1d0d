"""``drivebridge family new``: from a device description to a site that runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.base.errors import Fault, FileFaults, OperationFailed
from bridge.cli.app import make_app
from bridge.cli.simulation import simulated_nodes
from bridge.project import load_project
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.generic.generic_node import GenericNode
from tests.support import sites
from tests.support.invented import NAME, SPIN
from tests.support.invented_eds import SPIN as INVENTED
from tests.support.invented_eds import eds, pdo

RUN = CliRunner()


def new(*arguments: str) -> str:
    result = RUN.invoke(make_app("family"), ["family", "new", *arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_the_mapping_is_beside_the_site_and_named_by_the_device(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spin.eds").write_bytes(eds())
    assert new("spin.eds") == (
        "mappings/acme-gmbh/spin-3000.toml: Spin 3000, cia402/velocity, 11 parameters\n"
    )
    node = sites.node(sites.drive("drive", "none", 0, ""), mapping="acme-gmbh/spin-3000")
    project = load_project(sites.write(tmp_path, sites.bus(node)))
    simulated = simulated_nodes(project.site.bus[0], project.path)
    assert [type(one) for one in simulated] == [Cia402Drive]


def test_a_mapping_that_is_there_is_kept(tmp_path: Path) -> None:
    file, output = tmp_path / "spin.eds", tmp_path / "own" / "spin.toml"
    file.write_bytes(eds())
    new(str(file), "--output", str(output))
    output.write_text("mine", encoding="utf-8")
    with pytest.raises(OperationFailed, match="is there already"):
        new(str(file), "--output", str(output))
    assert output.read_text(encoding="utf-8") == "mine"


WHOLE = eds(INVENTED)
LATE = WHOLE.index(b"[6044]")


@pytest.mark.parametrize(
    ("content", "line"),
    [
        pytest.param(WHOLE[:-4], WHOLE.count(b"\n"), id="within a key"),
        pytest.param(WHOLE[: LATE + 25], WHOLE[:LATE].count(b"\n") + 2, id="within a value"),
        pytest.param(b'<?xml version="1.0"?>\n<a>\n<CANopenObject index="1000" name="x"/>', 3, id="XML"),
    ],
)
def test_half_a_file_becomes_no_mapping(tmp_path: Path, content: bytes, line: int) -> None:
    file, output = tmp_path / "spin.eds", tmp_path / "spin.toml"
    file.write_bytes(content)
    with pytest.raises(FileFaults, match=rf"spin.eds:{line}: .*breaks off.*fetched anew"):
        new(str(file), "--output", str(output))
    assert not output.exists()


@pytest.mark.parametrize("end", [b"", b"\r\n\x1a"])
def test_a_file_whose_last_line_has_no_end_is_whole(tmp_path: Path, end: bytes) -> None:
    file = tmp_path / "spin.eds"
    file.write_bytes(WHOLE.rstrip() + end)
    assert "11 parameters" in new(str(file), "--output", str(tmp_path / "spin.toml"))


def test_what_could_not_be_read_is_told(tmp_path: Path) -> None:
    file = tmp_path / "spin.eds"
    file.write_bytes(
        eds().replace(b"[2004]\nParameterName=temperature\nObjectType=0x7\nDataType=0x3", b"[2004]")
    )
    said = new(str(file), "--output", str(tmp_path / "spin.toml"))
    assert "2004h has no DataType" in said


def test_where_the_file_contradicts_itself_is_told(tmp_path: Path) -> None:
    file = tmp_path / "spin.eds"
    content = eds({**INVENTED, **pdo("1400", "$NODEID+0x200", "0x60400010", "0x50000010")})
    file.write_bytes(content)
    line = content.decode().splitlines().index("[1600sub2]") + 1
    said = new(str(file), "--output", str(tmp_path / "spin.toml"))
    assert f"spin.eds:{line}: 1600h:02 maps 50000010h: 5000h:00 is not described" in said


def test_a_mapping_that_cannot_be_written_whole_is_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, output = tmp_path / "spin.eds", tmp_path / "spin.toml"
    file.write_bytes(eds())

    def fails(path: Path, folders: object) -> None:
        raise FileFaults([Fault(str(path), 3, "slot", "is wrong")])

    monkeypatch.setattr("bridge.cli.family_command.read_family", fails)
    with pytest.raises(FileFaults, match=r"spin.toml:3: slot"):
        new(str(file), "--output", str(output))
    assert not output.exists()


def test_a_file_that_is_none_is_a_fault(tmp_path: Path) -> None:
    file = tmp_path / "spin.eds"
    file.write_bytes(b"nothing")
    with pytest.raises(FileFaults, match="is not a device description"):
        new(str(file))


def test_a_mapping_that_extends_nothing_is_simulated(tmp_path: Path) -> None:
    path = tmp_path / "mappings" / f"{NAME}.toml"
    path.parent.mkdir(parents=True)
    path.write_text(SPIN, encoding="utf-8")
    drive = sites.drive("axis", "none", 0, "parameters = { P7 = 1500.0 }")
    project = load_project(sites.write(tmp_path, sites.bus(sites.node(drive, mapping=NAME))))
    simulated = simulated_nodes(project.site.bus[0], project.path)
    assert [type(one) for one in simulated] == [GenericNode]


def test_a_drive_that_has_only_its_eds_is_played_as_the_mapping_made_of_it(tmp_path: Path) -> None:
    (tmp_path / "spin.eds").write_bytes(eds())
    node = sites.node(sites.drive("drive", "none", 0, ""), mapping="eds:spin.eds")
    project = load_project(sites.write(tmp_path, sites.bus(node)))
    simulated = simulated_nodes(project.site.bus[0], project.path)
    assert [type(one) for one in simulated] == [Cia402Drive]
