"""Who may command which drive, what is sent to it, and what happens when the controller falls silent."""

from bridge.command.audit import Rejection
from bridge.command.drive import Drive, Identification
from bridge.command.event import Event, Kind
from bridge.command.plant import Node, Plant
from bridge.command.request import Action, Code, Identity, Outcome, Reply, Request, Role, Source

__all__ = [
    "Action",
    "Code",
    "Drive",
    "Event",
    "Identification",
    "Identity",
    "Kind",
    "Node",
    "Outcome",
    "Plant",
    "Rejection",
    "Reply",
    "Request",
    "Role",
    "Source",
]
