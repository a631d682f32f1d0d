"""A coupler whose modules nobody names."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import lint
from bridge.project import load_project
from tests.support.couplers import connected, coupler, written

SAID = "the file knows 4 modules, and none is named: what they bring is not served"


@pytest.mark.parametrize(
    ("modules", "plugged", "is_said"), [((), (), True), (("AC-DI8",), (), False), ((), (1,), False)]
)
def test_that_none_is_named_is_said(
    tmp_path: Path, modules: tuple[str, ...], plugged: tuple[int, ...], is_said: bool
) -> None:
    path = written(tmp_path, *modules, outputs="")
    (tmp_path / "coupler.eds").write_bytes(coupler(more=connected(*plugged) if plugged else ""))
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    found = [one.fault for one in verdict.findings if one.fault.message == SAID]
    assert bool(found) is is_said
    if found:
        assert (
            found[0].hint == 'modules = ["AC-DI8", "AC-DI4", "AC-DO8", …], in the order in which they stand'
        )
        assert path.read_text().splitlines()[found[0].line - 1].startswith("mapping = ")
