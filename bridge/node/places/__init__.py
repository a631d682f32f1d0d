"""Where a node's parameters and words are: its SDO channels, and the places in its PDOs."""
