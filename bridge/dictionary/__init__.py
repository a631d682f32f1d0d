"""Object dictionaries for the ``canopen`` package, of drive families, mapping files and device descriptions.

Needs that package, which is an extra: nothing else of the bridge does.
"""

from bridge.dictionary.family_objects import add_family as add_family
from bridge.dictionary.load_dictionary import as_eds as as_eds
from bridge.dictionary.load_dictionary import load_dictionary as load_dictionary
from bridge.dictionary.object_dictionary import dictionary_of as dictionary_of
