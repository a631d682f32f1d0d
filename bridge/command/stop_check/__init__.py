"""Judges of the last stop: of one drive, and of the outputs of a node. Sans-IO."""
