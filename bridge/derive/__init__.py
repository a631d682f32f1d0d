"""Mapping files made from device descriptions, and site files from what is on a bus."""

from bridge.derive.family import Derived as Derived
from bridge.derive.family import derive_family as derive_family
from bridge.derive.family import describe as describe
from bridge.derive.proposed_site import ProposedBus as ProposedBus
from bridge.derive.proposed_site import ProposedNode as ProposedNode
from bridge.derive.proposed_site import propose_site as propose_site
