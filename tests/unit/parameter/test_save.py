"""Saving on a node that has no 1010h, or refuses it otherwise: the two are told apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed
from bridge.cli.app import make_app
from bridge.cli.parameter_drive import Target
from bridge.derive import derive_family
from bridge.mapping import load_family
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError, Transfer, TransferFailed, Why
from bridge.parameter.protection import Gate
from bridge.text import Text
from tests.support import sites
from tests.support.invented_eds import BASIC, U32, Section, described, family_of, record, var

CIA402 = load_family("cia402/velocity")
LENZE = load_family("lenze/8400-motec")
GATE = Gate(is_engineer=True, is_moving=lambda: False)
NO_OBJECT, NO_SUB = 0x0602_0000, 0x0609_0011


def saved(access: DriveParameters, abort_code: int | None) -> tuple[Transfer, str]:
    """The write, and the reason of the guard, for a node that answers with this abort code; None: it
    saves."""
    steps = access.save(0.0, GATE)
    transfer = next(steps)
    try:
        if abort_code is None:
            steps.send((b"", 1.0))
        else:
            steps.throw(TransferFailed(Text.plain("refused"), abort_code, by_drive=True))
    except StopIteration as end:
        return transfer, end.value
    raise AssertionError("one transfer saves")


def access_of(family: Any) -> DriveParameters:
    return DriveParameters("fan/drive", "fan", family, Names(family), Ledger())


@pytest.mark.parametrize(
    ("family", "code", "why"),
    [
        (CIA402, NO_OBJECT, Why.NOT_CONFIGURED),
        (CIA402, NO_SUB, Why.NOT_CONFIGURED),
        (CIA402, 0x0800_0022, Why.REFUSED),
        (CIA402, 0x0606_0000, Why.REFUSED),
        # A command of the family's own is there, or the mapping file is wrong.
        (LENZE, NO_OBJECT, Why.REFUSED),
    ],
)
def test_no_object_to_save_by_is_no_fault_of_saving(family: Any, code: int, why: Why) -> None:
    with pytest.raises(ParameterError) as told:
        saved(access_of(family), code)
    assert told.value.why is why
    if why is Why.NOT_CONFIGURED:
        assert str(told.value) == "the node has no 1010h:01, and saves nothing on command"


@pytest.mark.parametrize(
    ("store", "saves", "on_command_only"),
    [
        (None, False, False),
        (var("save all", U32, "ro", "2"), False, False),
        (var("save all", U32, "rw", "1"), True, True),
        (var("save all", U32, "wo"), True, True),
        # CiA 301 §7.5.2.13: it saves by itself, too.
        (var("save all", U32, "rw", "3"), True, False),
    ],
)
def test_a_device_saves_where_its_description_has_1010h(
    tmp_path: Path, store: Section | None, saves: bool, on_command_only: bool
) -> None:
    sections = {**BASIC, "1000": var("device type", U32, "ro", "0x20191")}
    sections |= record("1010", "store", store) if store else {}
    family = family_of(tmp_path, derive_family(described(sections), "block.eds"))
    access = access_of(family)
    assert (access.saving is not None) is saves
    if saves:
        transfer, _ = saved(access, None)
        assert (str(transfer.address), transfer.data) == ("1010:01", b"save")
        assert family.eeprom is not None
        assert family.eeprom.written_on_save_only is on_command_only


def attempting(code: int | None) -> Callable[..., Any]:
    """``Target.attempt`` on a node that takes the write, or aborts it with this code."""

    def attempt(_: object, make: Callable[[float], Any], **__: object) -> Any:
        steps = make(0.0)
        try:
            next(steps)
            if code is None:
                steps.send((b"", 1.0))
            else:
                steps.throw(TransferFailed(Text.plain("refused"), code, by_drive=True))
        except StopIteration as end:
            return end.value
        except ParameterError as error:
            return error

    return attempt


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (None, "fan: saved"),
        (NO_OBJECT, "fan: nothing saved: the node has no 1010h:01, and saves nothing on command"),
        (0x0800_0022, None),
    ],
)
def test_the_command_line_goes_on_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int | None, said: str | None
) -> None:
    drive = sites.drive("drive", "none", 0, "")
    node = sites.node(drive, name="fan", mapping="cia402/velocity")
    site = sites.write(tmp_path, sites.socketcan(node))
    monkeypatch.setattr(Target, "attempt", attempting(code))
    monkeypatch.setattr(Target, "alone", lambda *_, **__: Mock(gate=GATE))
    arguments = ["parameters", "save", str(site), "fan", "--yes"]
    done = CliRunner().invoke(make_app(), arguments)
    if said is None:
        assert isinstance(done.exception, OperationFailed)
    else:
        assert said in done.output, done.output
        assert done.exit_code == 0
