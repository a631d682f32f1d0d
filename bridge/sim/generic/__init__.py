"""Nodes made of a mapping file or of a device description."""
