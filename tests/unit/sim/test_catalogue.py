"""From a family and its parameters to a simulated node."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.sim.catalogue import simulate_node


def test_an_unknown_family_names_the_known_ones():
    with pytest.raises(OperationFailed, match="nord/sk-tu4-cao"):
        simulate_node("acme/anvil", 5, {})
