"""Device descriptions: EDS and DCF (CiA 306), XDD and XDC (CiA 311), concise DCF (CiA 302-3, 1F22h).

The readers accept files as they are found in the field, not only as the standards want them, and report every
oddity with its line. They raise ``FileFaults`` and nothing else.
"""

from bridge.eds.configuration import configuration as configuration
from bridge.eds.contradictions import contradictions as contradictions
from bridge.eds.device_file import read_configuration as read_configuration
from bridge.eds.device_file import read_device as read_device
from bridge.eds.device_file import read_device_file as read_device_file
from bridge.eds.device_file import read_whole_device_file as read_whole_device_file
from bridge.eds.model import Access as Access
from bridge.eds.model import Description as Description
from bridge.eds.model import Entry as Entry
from bridge.eds.model import Finding as Finding
from bridge.eds.model import FindingSeverity as FindingSeverity
from bridge.eds.model import StaticDataType as StaticDataType
from bridge.eds.model import Value as Value
from bridge.eds.site_configurations import read_configurations as read_configurations
