"""Drive families as data."""

from bridge.mapping.loader import family_names as family_names
from bridge.mapping.loader import load_family as load_family
from bridge.mapping.loader import read_family as read_family
from bridge.mapping.model import Family as Family
