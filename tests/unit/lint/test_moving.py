"""Downloads of the boot-up that would move something are errors, each at its key."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity
from tests.support.lint_site import judge


def moving(folder: Path, ref: str, value: int, kind: str = "uint16") -> list[str]:
    node = f'[[bus.node.configure]]\nobject = "{ref}"\ntype = "{kind}"\nvalue = {value}'
    found = judge(folder, node=node).of(Severity.ERROR)
    return [one.fault.message for one in found if "commands what the node moves" in one.fault.message]


def test_what_commands_a_drive_is_an_error(tmp_path: Path) -> None:
    (message,) = moving(tmp_path, "6040:00", 15)
    assert "of conveyor is 15 at every boot-up" in message


@pytest.mark.parametrize(("ref", "value"), [("6040:00", 0), ("2066:01", 15)])
def test_0_and_a_setting_move_nothing(tmp_path: Path, ref: str, value: int) -> None:
    assert moving(tmp_path, ref, value) == []
