"""Parameters of drives by the vendor's own names: what they are called, how they are coded, what writing
them wears out, and backups of them. No bus in here."""

from bridge.parameter.access import DriveParameters, Reading, Transfer, Written
from bridge.parameter.definition import Address, Entry
from bridge.parameter.error import ParameterError, TransferFailed, Why
from bridge.parameter.ledger import Ledger
from bridge.parameter.names import Names

__all__ = [
    "Address",
    "DriveParameters",
    "Entry",
    "Ledger",
    "Names",
    "ParameterError",
    "Reading",
    "Transfer",
    "TransferFailed",
    "Why",
    "Written",
]
