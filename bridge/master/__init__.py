"""The CANopen master: the buses of a site, and the timing of everything done on them."""
