"""Checkpoints hold the core and nothing else, whoever made them."""

from __future__ import annotations

import ast
import importlib.util
import os
import pickle
from pathlib import Path
from typing import Any

import msgspec
import pytest

import bridge
from bridge.can.interface import BusStatus
from bridge.config import load_site
from bridge.recorder.checkpoint import Outside, load, save
from bridge.recorder.core_names import Unusable, is_core
from bridge.recorder.replay import PlayedAlarm, PlayedBus, PlayingTape
from bridge.recorder.tape import facts_of, machine_tape
from tests.plant.plan import Plan
from tests.support.core import core_of
from tests.support.process import REPOSITORY
from tests.support.recorded import RecordedPlant

SITES = (REPOSITORY / "bridge" / "demo" / "site.toml", *sorted((REPOSITORY / "deploy").glob("*.toml")))
_OPENS = {
    "asyncio",
    "concurrent",
    "ctypes",
    "importlib",
    "io",
    "multiprocessing",
    "os",
    "pathlib",
    "shutil",
    "signal",
    "socket",
    "ssl",
    "subprocess",
    "tempfile",
    "threading",
    "time",
}
"""Libraries that open, wait, run or look at a clock."""


def loaded(data: bytes) -> Any:
    tape = PlayingTape()
    return load(data, tape, lambda name: PlayedBus(name, tape, facts_of(BusStatus())), PlayedAlarm())


def pickled(*states: object) -> bytes:
    """A checkpoint with these pickles for its root and the states of its objects."""
    return msgspec.msgpack.encode(([], b"".join(pickle.dumps(state) for state in states)))


class Evil:
    def __init__(self, call: Any, *args: Any) -> None:
        self._call = call, args

    def __reduce__(self) -> Any:
        return self._call


@pytest.mark.parametrize(
    "evil",
    [
        Evil(os.system, "true"),
        Evil(eval, "1"),
        Evil(getattr, "", "join"),
        Evil(load_site, Path("site.toml")),
        Evil(importlib.util.find_spec, "os"),
        Path("/etc/passwd"),
        pickle.Unpickler,
    ],
    ids=["system", "eval", "getattr", "load_site", "import", "path", "class outside"],
)
def test_what_is_not_of_the_core_is_refused(evil: object) -> None:
    with pytest.raises(Unusable):
        loaded(pickled(evil))


@pytest.mark.parametrize("module", ["os", "bridge.parameter.ledger_file", "bridge.service.bus_process"])
def test_an_object_of_another_module_is_refused(module: str) -> None:
    with pytest.raises(Unusable, match="no class of the core"):
        loaded(msgspec.msgpack.encode(([(module, "LedgerFile")], pickle.dumps(None))))


@pytest.mark.parametrize("data", [b"", b"nonsense", b"\x92\x90\xc4\x00", pickled(1)[:-2]])
def test_a_damaged_one_is_refused(data: bytes) -> None:
    with pytest.raises(Unusable):
        loaded(data)


def test_a_number_reserves_no_memory() -> None:
    """A reference that is to be kept under a number beyond all others."""
    with pytest.raises(Unusable, match="LONG_BINPUT"):
        loaded(msgspec.msgpack.encode(([], b"\x80\x05]r\xff\xff\xff\x7f.")))


def test_no_module_that_may_be_named_opens_or_waits() -> None:
    """All that a checkpoint names may be called by it."""
    root = Path(bridge.__file__).parent
    wrong: list[str] = []
    for path in root.rglob("*.py"):
        module = ".".join(("bridge", *path.relative_to(root).with_suffix("").parts))
        if not is_core(module) or module == "bridge.master.master":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [one.name for one in node.names] if isinstance(node, ast.Import) else []
            wrong += [f"{module}: {name}" for name in names if name.partition(".")[0] in _OPENS]
    assert not wrong


def test_objects_that_lead_to_each_other_are_the_same_afterwards(tmp_path: Path) -> None:
    plant = RecordedPlant(tmp_path, Plan(1, 1.0, ()))
    master, view, core = loaded(plant.core())
    assert view.image is core.image
    assert all(node.image is core.image for node in core.nodes.values() if hasattr(node, "image"))
    first = next(iter(core.drives.values()))
    assert core.members[first.name] is first
    assert type(master) is type(plant.plant.bridge.master)
    plant.plant.close()


def test_what_is_outside_does_nothing() -> None:
    assert loaded(save([print, Outside(), Path("x")]))[0]("nothing is printed") is None


def test_no_password_is_in_it(tmp_path: Path) -> None:
    """The settings of the servers are not of the core."""
    path = tmp_path / "site.toml"
    path.write_text(
        f"""
[site]
name = "hall"
state_dir = "{tmp_path}"
runtime_dir = "{tmp_path}"
[[bus]]
name = "can0"
interface = "virtual"
[opcua]
listen = "127.0.0.1:0"
[[opcua.user]]
name = "anna"
role = "operator"
password_hash = "scrypt$16384$8$1$c2FsdHNhbHRzYWx0c2FsdA==$SECRET"
[zenoh]
user = "bridge"
password_file = "{tmp_path}/keys"
""",
        encoding="utf-8",
    )
    site = load_site(path)
    saved = save(site)
    assert site.opcua
    assert b"anna" not in saved
    assert b"keys" not in saved
    assert loaded(saved).bus[0].name == "can0"


@pytest.mark.parametrize("site", SITES, ids=lambda path: path.stem)
def test_every_family_can_be_put_into_a_checkpoint(site: Path) -> None:
    """Nothing that a core leads to is forgotten: what is neither of it nor around it would be named."""
    core = core_of(site, machine_tape())
    _, _, again = loaded(save(tuple(core)))
    assert again.drives.keys() == core.plant.drives.keys()
    assert again.nodes.keys() == core.plant.nodes.keys()
