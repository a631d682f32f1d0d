"""Drive logic without vendor names: words, states, values, emergencies."""

from bridge.drive.emergency import EmergencyReader as EmergencyReader
from bridge.drive.emergency import Told as Told
from bridge.drive.fault_words import Explained as Explained
from bridge.drive.fault_words import FaultWords as FaultWords
from bridge.drive.meaning import Codes as Codes
from bridge.drive.meaning import Lack as Lack
from bridge.drive.meaning import Meanings as Meanings
from bridge.drive.meaning import codecs as codecs
from bridge.drive.meaning import default_codecs as default_codecs
from bridge.drive.meaning import default_codes as default_codes
from bridge.drive.own_supervision import OwnJudgement as OwnJudgement
from bridge.drive.own_supervision import OwnVerdict as OwnVerdict
from bridge.drive.parameter_set import ParameterSet as ParameterSet
from bridge.drive.scaling import LinearScale as LinearScale
from bridge.drive.scaling import is_scale as is_scale
from bridge.drive.scaling import no_scale as no_scale
from bridge.drive.scaling import scale_of as scale_of
from bridge.drive.values import ValueCodec as ValueCodec
from bridge.drive.values import Written as Written
from bridge.drive.values import scales_of as scales_of
from bridge.drive.words import DRIVE_STATES as DRIVE_STATES
from bridge.drive.words import FAULTED as FAULTED
from bridge.drive.words import MOVING as MOVING
from bridge.drive.words import ControlWords as ControlWords
from bridge.drive.words import DriveState as DriveState
from bridge.drive.words import StatusWords as StatusWords
