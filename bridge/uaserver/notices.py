"""What strangers do wrong on OPC UA, in the log."""

from __future__ import annotations

from typing import Final

from bridge.base.notices import Teller, teller

tell: Final[Teller] = teller("OPC UA")
