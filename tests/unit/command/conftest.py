from __future__ import annotations

import pytest

from tests.support.rig import Rig


@pytest.fixture
def rig() -> Rig:
    """A NORD drive that a control program commands over Modbus, P151 = 200 ms."""
    return Rig()


@pytest.fixture
def running(rig: Rig) -> Rig:
    """The same, in operation enabled at half speed."""
    rig.run()
    return rig
