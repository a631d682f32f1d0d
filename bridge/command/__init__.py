"""Who may command which drive, what is sent to it, and what happens when the controller falls silent."""

from bridge.command.audit import Rejection
from bridge.command.drive import Drive, Identification
from bridge.command.event import Event, Kind
from bridge.command.plant import Node, Plant
from bridge.command.request import (
    Action,
    Code,
    Command,
    Do,
    Identity,
    Outcome,
    ReadParameter,
    Reply,
    Request,
    Role,
    SetTimeout,
    Source,
    Start,
    TakeControl,
    Write,
    WriteParameter,
    command_of,
)
from bridge.command.view import PlantView

__all__ = [
    "Action",
    "Code",
    "Command",
    "Do",
    "Drive",
    "Event",
    "Identification",
    "Identity",
    "Kind",
    "Node",
    "Outcome",
    "Plant",
    "PlantView",
    "ReadParameter",
    "Rejection",
    "Reply",
    "Request",
    "Role",
    "SetTimeout",
    "Source",
    "Start",
    "TakeControl",
    "Write",
    "WriteParameter",
    "command_of",
]
