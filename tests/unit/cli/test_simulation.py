"""Simulated nodes of a site: one for each node of a bus, and the habits that words give them."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

from bridge.cli.simulation import habits_of, simulated_nodes
from bridge.config import load_site
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support import sites


def site_of(folder: Path) -> Path:
    nodes = [
        sites.node(sites.drive("fu1", "none", 0, "parameters = { P105 = 60.0 }"), name="a", node_id=5),
        sites.node(sites.drive("axis", "none", 0, ""), name="b", node_id=6, mapping="cia402/velocity"),
    ]
    slot = sites.family("cia402/velocity").slot[0].name
    nodes[1] = nodes[1].replace('slot = "axis"', f'slot = "{slot}"')
    return sites.write(folder, sites.bus(*nodes))


def test_each_node_of_a_bus_is_there_with_its_number(tmp_path: Path) -> None:
    path = site_of(tmp_path)
    first, second = simulated_nodes(load_site(path).bus[0], path)
    assert (first.node_id, second.node_id) == (5, 6)
    assert isinstance(first, NordTu4)
    assert not isinstance(second, NordTu4)


@pytest.mark.parametrize(
    ("word", "why"),
    [
        ("a", "--habit a: give NODE=HABIT"),
        ("c=late", "--habit c=late: c is no node; a, b"),
    ],
)
def test_a_habit_is_a_nodes(tmp_path: Path, word: str, why: str) -> None:
    site = load_site(site_of(tmp_path))
    with pytest.raises(typer.BadParameter) as caught:
        habits_of([word], site)
    assert str(caught.value) == why
    assert habits_of([], site) == {}
