"""Exposure of a bus to somebody else's frames: within which time and how often they are answered."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config import load_site
from bridge.lint.checked_bus import view_bus
from bridge.lint.intruder import Exposure, exposure
from tests.support import sites


def of_site(folder: Path, bus: str = "", count: int = 1) -> Exposure:
    nodes = [
        sites.node(sites.drive("fu1", "none", 0, ""), name=f"n{number}", node_id=number)
        for number in range(1, count + 1)
    ]
    site = load_site(sites.write(folder, sites.bus(*nodes, more=bus)))
    families = {sites.FAMILY: sites.family(sites.FAMILY)}
    return exposure(view_bus(site.bus[0], ("bus", 0), families, {}, {}))


def test_an_answer_takes_its_look_its_way_and_its_turn(tmp_path: Path) -> None:
    found = of_site(tmp_path)
    assert found.bus == "can0"
    assert found.within_ms is not None
    assert 10 < found.within_ms < 100
    assert found.share_percent == 20


def test_a_faster_bus_answers_more_often(tmp_path: Path) -> None:
    slow, fast = of_site(tmp_path, "bitrate = 125000"), of_site(tmp_path, "bitrate = 1000000")
    assert fast.answers_per_s == pytest.approx(8 * slow.answers_per_s, abs=8)
    assert fast.within_ms is not None
    assert slow.within_ms is not None
    assert fast.within_ms <= slow.within_ms


def test_what_is_said_of_it() -> None:
    told = str(Exposure("can0", "stop_node", 36, 81, 20))
    assert told.startswith(
        "can0: an intruder is answered within 36 ms, up to 81 times a second (20 % of the bus)"
    )
    assert "not in a known time" in str(Exposure("can0", "stop_node", None, 81, 20))
    told = str(Exposure("can0", "report", 36, 81, 20))
    assert told == "can0: an intruder is only reported: it can run drives as long as it likes"
