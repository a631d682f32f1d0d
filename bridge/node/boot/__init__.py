"""Boot-up of a node after CiA 302-2."""

from bridge.node.boot.actions import Action as Action
from bridge.node.boot.actions import Await as Await
from bridge.node.boot.actions import Boot as Boot
from bridge.node.boot.actions import BootResult as BootResult
from bridge.node.boot.actions import DeviceErrors as DeviceErrors
from bridge.node.boot.actions import DrivePlan as DrivePlan
from bridge.node.boot.actions import Nmt as Nmt
from bridge.node.boot.actions import NodePdoPlan as NodePdoPlan
from bridge.node.boot.actions import Pause as Pause
from bridge.node.boot.actions import PdoPlan as PdoPlan
from bridge.node.boot.actions import Read as Read
from bridge.node.boot.actions import ResetCommunication as ResetCommunication
from bridge.node.boot.actions import Signal as Signal
from bridge.node.boot.actions import Step as Step
from bridge.node.boot.actions import Write as Write
from bridge.node.boot.error_control import heartbeat_period_ms as heartbeat_period_ms
from bridge.node.boot.layout import factory_entries as factory_entries
from bridge.node.boot.layout import layouts as layouts
from bridge.node.boot.layout import match_words as match_words
from bridge.node.boot.listening import rpdo_plan as rpdo_plan
from bridge.node.boot.memory import BootMemory as BootMemory
from bridge.node.boot.pdo_settings import MOST_ENTRIES as MOST_ENTRIES
from bridge.node.boot.procedure import boot as boot
from bridge.node.boot.scales import parameter_value as parameter_value
from bridge.node.boot.status import BootError as BootError
