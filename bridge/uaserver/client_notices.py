"""Log lines on the faults of OPC UA clients."""

from __future__ import annotations

from typing import Final

from bridge.base.notices import Teller, teller

tell: Final[Teller] = teller("OPC UA")
