"""Conditions (OPC 10000-9): their states, their methods, their fields."""
