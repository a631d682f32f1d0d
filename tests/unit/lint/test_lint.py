"""The linter as a whole: a sound site has no findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity
from tests.support.lint_site import findings, judge


def test_a_sound_site_has_no_findings(tmp_path: Path) -> None:
    assert judge(tmp_path).findings == ()


@pytest.mark.parametrize("object_", ["1010:01", "1011:01"])
@pytest.mark.parametrize(("more", "number"), [("", 1), ("read_back = false", 0)])
def test_a_command_that_is_to_be_read_back_is_doubtful(
    tmp_path: Path, object_: str, more: str, number: int
) -> None:
    node = f'[[bus.node.configure]]\nobject = "{object_}"\ntype = "uint32"\nvalue = 1702257011\n{more}'
    found = findings(judge(tmp_path, node=node), Severity.WARNING)
    assert len(found) == number
    assert all("is a command: it never reads back as it was written" in text for text in found)
