"""The third-party scripts of the page: only what package-lock.json pins, and nothing without saying so."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import tarfile
import urllib.request
from pathlib import Path

import pytest

from tools import page_scripts
from tools.page_scripts import PAGE, VENDOR, WANTED, ScriptsMissing, is_intact, place, with_own_names


def tarball(files: dict[str, str]) -> bytes:
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz") as archive:
        for name, text in files.items():
            entry = tarfile.TarInfo(f"package/{name}")
            entry.size = len(text.encode())
            archive.addfile(entry, io.BytesIO(text.encode()))
    return packed.getvalue()


def integrity(content: bytes) -> str:
    return "sha512-" + base64.b64encode(hashlib.sha512(content).digest()).decode()


class Registry:
    """One with a tarball of each package, and a lock that pins them."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.tarballs = {
            package: tarball({**dict.fromkeys(files, f"// {package}\n"), "LICENSE": f"licence of {package}"})
            for package, files in WANTED.items()
        }
        self.asked: list[str] = []
        self.pin()

    def pin(self) -> None:
        packages = {
            f"node_modules/{package}": {"version": "1.2.3", "integrity": integrity(content)}
            for package, content in self.tarballs.items()
        }
        lock = self.root / PAGE / "package-lock.json"
        lock.parent.mkdir(parents=True, exist_ok=True)
        lock.write_text(json.dumps({"packages": packages}))

    def open(self, url: str, timeout: float) -> io.BytesIO:
        self.asked.append(url)
        package = url.removeprefix("https://registry.npmjs.org/").partition("/-/")[0]
        return io.BytesIO(self.tarballs[package])


@pytest.fixture
def registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("NPM_CONFIG_REGISTRY", raising=False)
    one = Registry(tmp_path / "root")
    monkeypatch.setattr(urllib.request, "urlopen", one.open)
    return one


def test_what_the_lock_pins_is_placed_with_its_licence(registry: Registry) -> None:
    place(registry.root)
    vendor = registry.root / VENDOR
    assert (vendor / "preact.mjs").read_text() == "// @ts-nocheck\n// preact\n"
    assert (vendor / "licenses" / "@preact+signals.txt").read_text() == "licence of @preact/signals"
    assert registry.asked[0] == "https://registry.npmjs.org/preact/-/preact-1.2.3.tgz"
    assert "https://registry.npmjs.org/@preact/signals/-/signals-1.2.3.tgz" in registry.asked


def test_nothing_is_fetched_a_second_time(registry: Registry) -> None:
    place(registry.root)
    registry.asked.clear()
    place(registry.root)
    (registry.root / VENDOR / "made.json").unlink()
    place(registry.root)
    assert registry.asked == []


def test_another_tarball_than_the_pinned_one_is_refused(registry: Registry) -> None:
    registry.tarballs["htm"] = tarball({"dist/htm.mjs": "alert(1)", "LICENSE": ""})
    with pytest.raises(ScriptsMissing, match=r"htm-1\.2\.3\.tgz .* is not the one"):
        place(registry.root)
    assert not (registry.root / VENDOR / "htm.mjs").exists()


def test_a_spoilt_cache_is_not_trusted(registry: Registry) -> None:
    place(registry.root)
    (registry.root / VENDOR / "made.json").unlink()
    registry.asked.clear()
    [cached] = (registry.root.parent / "cache" / "drivebridge" / "npm").glob("htm-*")
    cached.write_bytes(b"spoilt")
    place(registry.root)
    assert len(registry.asked) == 1


def test_without_a_network_it_says_what_helps(registry: Registry, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(url: str, timeout: float) -> io.BytesIO:
        raise OSError("Network is unreachable")

    monkeypatch.setattr(urllib.request, "urlopen", no_network)
    with pytest.raises(ScriptsMissing, match=r"Network is unreachable.*copy .*drivebridge/npm"):
        place(registry.root)


def test_a_file_that_a_package_no_longer_has_is_named(registry: Registry) -> None:
    registry.tarballs["uplot"] = tarball({"LICENSE": ""})
    registry.pin()
    with pytest.raises(ScriptsMissing, match=r"uplot has no dist/uPlot\.esm\.js any more"):
        place(registry.root)


def test_a_package_that_is_not_pinned_is_named(registry: Registry) -> None:
    del registry.tarballs["htm"]
    registry.pin()
    with pytest.raises(ScriptsMissing, match="does not pin htm"):
        place(registry.root)


def test_only_sha_512_counts() -> None:
    assert is_intact(b"script", integrity(b"script"))
    assert not is_intact(b"script", "sha1-" + base64.b64encode(hashlib.sha1(b"script").digest()).decode())


def test_bare_names_become_those_of_the_neighbours() -> None:
    script = 'import{a}from"preact/hooks";import "./own.mjs";\n//# sourceMappingURL=signals.mjs.map\n'
    assert with_own_names(script) == 'import{a}from"./hooks.mjs";import "./own.mjs";\n'


def test_a_script_that_imports_what_is_not_there_is_refused() -> None:
    with pytest.raises(ScriptsMissing, match="imports left-pad"):
        with_own_names('import pad from "left-pad"')


def test_the_lock_pins_what_is_wanted() -> None:
    lock = json.loads((Path(page_scripts.__file__).parent.parent / PAGE / "package-lock.json").read_text())
    for package in WANTED:
        assert lock["packages"][f"node_modules/{package}"]["integrity"].startswith("sha512-")
