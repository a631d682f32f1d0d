"""Descriptions in every dialect of the field: read, made into a mapping, simulated, booted and served."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.eds.model import Report
from bridge.eds.text_file import decode
from bridge.mapping.loader import mappings_dir
from tests.support.devices import DEVICES
from tests.support.eds_dialects import in_every_dialect
from tests.support.foreign import Result, served, table
from tests.support.invented_eds import FIXED, SPIN, eds
from tests.support.nightly import IS_NIGHTLY, examples

_PART = 4
"""Dialects of a file: by day every fourth one, for the next file the next ones."""

FILES = {
    "spin.eds": eds(SPIN),
    "fixed.eds": eds(FIXED),
    **{name: (DEVICES / name).read_bytes() for name in ("encoder.eds", "io16.eds")},
    **{
        name: (mappings_dir() / name).read_bytes()
        for name in (
            "cia402/cia402.eds",
            "nord/sk-cu4-cao.eds",
            "nord/sk-tu4-cao.eds",
            "nord/sk-tu4-cao-ds402.eds",
        )
    },
}


@pytest.mark.landing
def test_every_dialect_is_understood(tmp_path: Path) -> None:
    results: list[Result] = []
    for seed, (name, content) in enumerate(FILES.items()):
        text = decode(content, Report())
        for place, (dialect, changed) in enumerate(in_every_dialect(text, seed)):
            if not IS_NIGHTLY and (place + seed) % _PART:
                continue
            results.append(served(tmp_path / f"{seed}{dialect}", f"{name} as {dialect}", changed))
    print(table(results))
    assert len(results) >= examples(100, 25)
    good = [one for one in results if not one.problem]
    assert len(good) >= 0.9 * len(results), table(results)
