"""Parameters of drives by the vendor's own names: what they are called, how they are coded, what writing
them wears out, and backups of them. No bus in here."""

from bridge.mapping.model import ObjectRef as ObjectRef
from bridge.parameter.access import DriveParameters as DriveParameters
from bridge.parameter.access import ParameterReading as ParameterReading
from bridge.parameter.access import ParameterWritten as ParameterWritten
from bridge.parameter.definition import ParameterEntry as ParameterEntry
from bridge.parameter.error import ParameterError as ParameterError
from bridge.parameter.error import TransferFailed as TransferFailed
from bridge.parameter.error import Why as Why
from bridge.parameter.ledger import Ledger as Ledger
from bridge.parameter.names import AxisNames as AxisNames
from bridge.parameter.names import Names as Names
from bridge.parameter.transfer import Transfer as Transfer
