"""The site file: its buses, nodes and drives, and who may see and command them.

Reference for users: ``docs/reference/site-file.md``.
"""

from bridge.config.field_types import IGNORE_ALL_S as IGNORE_ALL_S
from bridge.config.field_types import LIFE_SIGN_MS as LIFE_SIGN_MS
from bridge.config.field_types import WordOrder as WordOrder
from bridge.config.model import MODULES as MODULES
from bridge.config.model import BusTable as BusTable
from bridge.config.model import CableTable as CableTable
from bridge.config.model import DriveTable as DriveTable
from bridge.config.model import ListeningTable as ListeningTable
from bridge.config.model import ModbusTable as ModbusTable
from bridge.config.model import NodeTable as NodeTable
from bridge.config.model import OpcUaHistoryTable as OpcUaHistoryTable
from bridge.config.model import OpcUaTable as OpcUaTable
from bridge.config.model import OutputsTable as OutputsTable
from bridge.config.model import PageTable as PageTable
from bridge.config.model import PdoTable as PdoTable
from bridge.config.model import SafeValue as SafeValue
from bridge.config.model import Site as Site
from bridge.config.model import UserTable as UserTable
from bridge.config.model import ZenohTable as ZenohTable
from bridge.config.model import mapping_key as mapping_key
from bridge.config.point_patterns import fits as fits
from bridge.config.reaction import REACTIONS as REACTIONS
from bridge.config.reaction import Reaction as Reaction
from bridge.config.reaction import ReactionRule as ReactionRule
from bridge.config.reaction import StopKind as StopKind
from bridge.config.site_file import load_site as load_site
from bridge.config.site_file import read_site as read_site
