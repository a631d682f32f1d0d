"""Drive logic without vendor names: words, states, values, emergencies."""

from bridge.drive.emergency import EmergencyReader, Told
from bridge.drive.own_supervision import OwnJudgement, OwnVerdict
from bridge.drive.parameter_set import ParameterSet
from bridge.drive.scaling import LinearScale, scale_of
from bridge.drive.values import ValueCodec, Written
from bridge.drive.words import FAULTED, MOVING, STATES, ControlWords, DriveState, StatusWords

__all__ = [
    "FAULTED",
    "MOVING",
    "STATES",
    "ControlWords",
    "DriveState",
    "EmergencyReader",
    "LinearScale",
    "OwnJudgement",
    "OwnVerdict",
    "ParameterSet",
    "StatusWords",
    "Told",
    "ValueCodec",
    "Written",
    "scale_of",
]
