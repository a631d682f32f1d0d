"""The site file: which buses, nodes and drives there are, and who may see and command them.

Reference for users: ``docs/reference/site-file.md``.
"""

from bridge.config.fields import IGNORE_ALL_S, Control, Reaction, WordOrder
from bridge.config.load import load_site, read_site
from bridge.config.model import (
    BusTable,
    ConfigureTable,
    DriveTable,
    IdentityTable,
    ModbusTable,
    NodeTable,
    OpcUaTable,
    PdoTable,
    Site,
    SiteTable,
    UserTable,
    ZenohTable,
)

__all__ = [
    "IGNORE_ALL_S",
    "BusTable",
    "ConfigureTable",
    "Control",
    "DriveTable",
    "IdentityTable",
    "ModbusTable",
    "NodeTable",
    "OpcUaTable",
    "PdoTable",
    "Reaction",
    "Site",
    "SiteTable",
    "UserTable",
    "WordOrder",
    "ZenohTable",
    "load_site",
    "read_site",
]
