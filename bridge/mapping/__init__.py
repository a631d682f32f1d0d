"""Drive families as data."""

from bridge.mapping.loader import family_names, load_family, read_family
from bridge.mapping.model import Family

__all__ = ["Family", "family_names", "load_family", "read_family"]
