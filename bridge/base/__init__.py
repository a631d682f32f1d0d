"""Errors, the clock, limits and notices: for any part, and without a word of drives."""
