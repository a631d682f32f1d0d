"""Places of a node's parameters and words: its SDO channels, and the entries of its PDOs."""
