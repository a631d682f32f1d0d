"""Alarms: a condition for each place where the plant can have a trouble."""
