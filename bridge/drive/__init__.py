"""Drive logic without vendor names: words, states, scaling."""

from bridge.drive.scaling import LinearScale, signed
from bridge.drive.words import FAULTED, MOVING, STATES, ControlWords, DriveState, StatusWords

__all__ = [
    "FAULTED",
    "MOVING",
    "STATES",
    "ControlWords",
    "DriveState",
    "LinearScale",
    "StatusWords",
    "signed",
]
