"""Device descriptions: EDS and DCF (CiA 306), XDD and XDC (CiA 311), concise DCF (CiA 302-3, 1F22h).

The readers accept files as they are found in the field, not only as the standards want them, and report every
oddity with its line. They raise ``FileFaults`` and nothing else.
"""

from bridge.eds.configuration import configuration
from bridge.eds.load import read_configuration, read_device, read_device_file
from bridge.eds.model import Access, DataType, Description, Device, Entry, Finding, Object, Severity, Value
from bridge.eds.site import read_configurations

__all__ = [
    "Access",
    "DataType",
    "Description",
    "Device",
    "Entry",
    "Finding",
    "Object",
    "Severity",
    "Value",
    "configuration",
    "read_configuration",
    "read_configurations",
    "read_device",
    "read_device_file",
]
