"""The ways of values through the code are as short as they are to be, and as the page on the architecture
draws them."""

from __future__ import annotations

from pathlib import Path

from tools import ways

MOST_FILES = 12


async def test_the_page_draws_the_ways_that_values_take(tmp_path: Path) -> None:
    found = await ways.follow(tmp_path)
    assert {name: len(files) for name, files in found.items() if len(files) > MOST_FILES} == {}
    assert [list(files)[-1] for files in found.values()] == [
        "northbound/modbus/session.py",
        "northbound/opcua/values.py",
        "zenohlink/publishers.py",
        "can/softbus.py",
    ]
    for files in ways.ON_SOCKETCAN.values():
        assert all((ways.ROOT / "bridge" / file).is_file() for file in files)
    text = ways.PAGE.read_text(encoding="utf-8")
    assert text == ways.drawn(text, found), "draw it anew: python -m tools.ways"
