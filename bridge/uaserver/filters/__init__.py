"""Filters of monitored items: what of changes and events a client wants."""
