"""The STÖBER 5000, with one axis and with four."""
