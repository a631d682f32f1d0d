"""Description of a site: its points, its nodes and drives, their unit ids, codes and rights; no image, no
leg, no clock."""

from bridge.catalogue.codes import Source as Source
from bridge.catalogue.rights import Rights as Rights
from bridge.catalogue.rights import rights_of as rights_of
from bridge.catalogue.site import Catalogue as Catalogue
from bridge.catalogue.specs import FIRST_CHANNEL as FIRST_CHANNEL
from bridge.catalogue.specs import DeviceSpec as DeviceSpec
from bridge.catalogue.specs import DriveSpec as DriveSpec
from bridge.catalogue.specs import MemberSpec as MemberSpec
from bridge.catalogue.specs import NodeSpec as NodeSpec
