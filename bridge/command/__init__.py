"""Who may command which drive, what is sent to it, and what happens when the controller falls silent."""

from bridge.command.audit import Rejection as Rejection
from bridge.command.drive import Drive as Drive
from bridge.command.drive import Identification as Identification
from bridge.command.event import Event as Event
from bridge.command.event import Kind as Kind
from bridge.command.plant import HasParameters as HasParameters
from bridge.command.plant import Node as Node
from bridge.command.plant import Plant as Plant
from bridge.command.plant import PlantView as PlantView
from bridge.command.request import Action as Action
from bridge.command.request import Code as Code
from bridge.command.request import Command as Command
from bridge.command.request import Do as Do
from bridge.command.request import Identity as Identity
from bridge.command.request import Outcome as Outcome
from bridge.command.request import ReadParameter as ReadParameter
from bridge.command.request import Reply as Reply
from bridge.command.request import Request as Request
from bridge.command.request import Role as Role
from bridge.command.request import SetTimeout as SetTimeout
from bridge.command.request import Source as Source
from bridge.command.request import Start as Start
from bridge.command.request import TakeControl as TakeControl
from bridge.command.request import Write as Write
from bridge.command.request import WriteParameter as WriteParameter
from bridge.command.request import command_of as command_of
