"""Boot-up of a node after CiA 302-2."""

from bridge.southbound.boot.actions import (
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
from bridge.southbound.boot.error_control import heartbeat_period_ms
from bridge.southbound.boot.layout import factory_entries, layouts, match_words
from bridge.southbound.boot.listening import rpdo_plan
from bridge.southbound.boot.memory import BootMemory
from bridge.southbound.boot.pdo_settings import MOST_ENTRIES
from bridge.southbound.boot.procedure import boot
from bridge.southbound.boot.scales import number_from, parameter_value
from bridge.southbound.boot.status import BootError

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
    "number_from",
    "parameter_value",
    "rpdo_plan",
]
