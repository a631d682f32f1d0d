"""Paths of the diagnostics' nodes; the nodes themselves are in ``test_diagnosticnodes.py``."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.diagnostics.shapes import Shapes, path_of

SOURCES: Any = SimpleNamespace(sessions=[], diagnosed_subscriptions={})


@pytest.mark.parametrize(
    ("where", "path"),
    [
        (ua.NodeId("Diagnostics/a/b", 1), "a/b"),
        (ua.NodeId("Diagnostics/a", 2), ""),
        (ua.NodeId("Diagnostics", 1), ""),
        (ua.NodeId("Else/a", 1), ""),
        (ua.NodeId(b"Diagnostics/a", 1, ua.NodeIdType.ByteString), ""),
        (ua.NodeId(7, 1), ""),
    ],
)
def test_a_node_has_a_path_where_it_is_one_of_these(where: ua.NodeId, path: str) -> None:
    assert path_of(where) == path


@given(st.text(max_size=40) | st.text(st.sampled_from("/0٧"), max_size=20).map("Subscription/{}".format))
def test_no_path_of_a_stranger_finds_or_breaks_anything(path: str) -> None:
    assert Shapes(AddressSpace(), SOURCES).of(path) is None
