"""The wheel carries everything: mappings, demo site, command."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.process import REPOSITORY


def pip(*arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel unpacked, as pip does it; the libraries are those of this environment."""
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(REPOSITORY))
    [wheel] = folder.glob("drivebridge-*.whl")
    pip("install", "--no-deps", "--target", str(folder / "site"), str(wheel))
    return folder / "site"


def call(installed: Path, *command: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    return subprocess.run(
        [sys.executable, *command],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd=installed.parent,
        timeout=60,
    )


@pytest.mark.landing
def test_the_families_come_along(installed: Path) -> None:
    code = "import bridge; from bridge.mapping import family_names; print(bridge.__file__, *family_names())"
    done = call(installed, "-c", code)
    assert done.returncode == 0, done.stderr
    where, *families = done.stdout.split()
    assert where.startswith(str(installed))
    assert "nord/sk-tu4-cao" in families


@pytest.mark.landing
def test_the_demo_site_is_there_and_right(installed: Path) -> None:
    done = call(installed, "-m", "bridge", "check", str(installed / "bridge" / "demo" / "site.toml"))
    assert done.returncode == 0, done.stderr
    assert "7 drives on 1 bus" in done.stdout


def test_nothing_of_the_tests_comes_along(installed: Path) -> None:
    assert not (installed / "tests").exists()
    assert (installed / "bin" / "drivebridge").exists()


def test_the_models_of_opc_ua_come_along_with_their_licence(installed: Path) -> None:
    folder = installed / "bridge" / "northbound" / "opcua" / "nodesets"
    assert "OPC Foundation MIT License" in (folder / "LICENSE-MIT.txt").read_text()
    code = "from bridge.northbound.opcua.models.assets import read_models; print(len(read_models().models))"
    done = call(installed, "-c", code)
    assert (done.stdout, done.stderr) == ("7\n", "")
