"""Requests to a drive or an output with their telegrams, and the events told of it."""
