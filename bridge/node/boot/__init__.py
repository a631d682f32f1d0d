"""Boot-up of a node after CiA 302-2."""

from bridge.node.boot.actions import (
    Action,
    Await,
    AwaitRelease,
    Boot,
    BootResult,
    DeviceErrors,
    DrivePlan,
    Found,
    Nmt,
    NodePdoPlan,
    Pause,
    PdoPlan,
    Read,
    ResetCommunication,
    SendStopped,
    StartSupervision,
    Step,
    Wake,
    Write,
)
from bridge.node.boot.error_control import heartbeat_period_ms
from bridge.node.boot.layout import factory_entries, layouts, match_words
from bridge.node.boot.listening import rpdo_plan
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_settings import MOST_ENTRIES
from bridge.node.boot.procedure import boot
from bridge.node.boot.scales import parameter_value
from bridge.node.boot.status import BootError

__all__ = [
    "MOST_ENTRIES",
    "Action",
    "Await",
    "AwaitRelease",
    "Boot",
    "BootError",
    "BootMemory",
    "BootResult",
    "DeviceErrors",
    "DrivePlan",
    "Found",
    "Nmt",
    "NodePdoPlan",
    "Pause",
    "PdoPlan",
    "Read",
    "ResetCommunication",
    "SendStopped",
    "StartSupervision",
    "Step",
    "Wake",
    "Write",
    "boot",
    "factory_entries",
    "heartbeat_period_ms",
    "layouts",
    "match_words",
    "parameter_value",
    "rpdo_plan",
]
