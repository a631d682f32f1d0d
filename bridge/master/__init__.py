"""The CANopen master: the buses of a site, and when what is done on them."""
