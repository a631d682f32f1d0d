"""Who may command which drive, what is sent to it, and what happens when the controller falls silent."""

from bridge.command.audit import Rejection as Rejection
from bridge.command.drive import Drive as Drive
from bridge.command.drive import Identification as Identification
from bridge.command.messages.event import Event as Event
from bridge.command.messages.event import Kind as Kind
from bridge.command.messages.request import Action as Action
from bridge.command.messages.request import Code as Code
from bridge.command.messages.request import Command as Command
from bridge.command.messages.request import Do as Do
from bridge.command.messages.request import Identity as Identity
from bridge.command.messages.request import Outcome as Outcome
from bridge.command.messages.request import ReadParameter as ReadParameter
from bridge.command.messages.request import Reply as Reply
from bridge.command.messages.request import Request as Request
from bridge.command.messages.request import Role as Role
from bridge.command.messages.request import SetTimeout as SetTimeout
from bridge.command.messages.request import Source as Source
from bridge.command.messages.request import Start as Start
from bridge.command.messages.request import TakeControl as TakeControl
from bridge.command.messages.request import Write as Write
from bridge.command.messages.request import WriteParameter as WriteParameter
from bridge.command.messages.request import command_of as command_of
from bridge.command.node import HasParameters as HasParameters
from bridge.command.node import Node as Node
from bridge.command.plant import Plant as Plant
from bridge.command.plant import PlantView as PlantView
