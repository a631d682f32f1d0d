"""NORD inverters: the SK TU4 with up to four drives behind it, and single drives."""
