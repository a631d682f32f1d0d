"""The ways of values through the code are as short as they are to be, and as the page on the architecture
draws them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools import ways

MOST_FILES = 12
BY_TWO_PROCESSES = {"A TPDO to a zenoh key": 14}
"""With both ends of the link to the front, and zenoh's worker there."""


@pytest.mark.landing
async def test_the_page_draws_the_ways_that_values_take(tmp_path: Path) -> None:
    found = await ways.follow(tmp_path)
    counts = {name: len(files) for name, files in found.items()}
    assert {
        name: count for name, count in counts.items() if count > BY_TWO_PROCESSES.get(name, MOST_FILES)
    } == {}
    assert [list(files)[-1] for files in found.values()] == [
        "northbound/modbus/connection.py",
        "northbound/opcua/space/data_values.py",
        "zenohlink/publishers.py",
        "can/softbus.py",
    ]
    for files in ways.ON_SOCKETCAN.values():
        assert all((ways.ROOT / "bridge" / file).is_file() for file in files)
    text = ways.PAGE.read_text(encoding="utf-8")
    assert text == ways.drawn(text, found), "draw it anew: python -m tools.ways"
