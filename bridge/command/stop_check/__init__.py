"""Whether what is commanded does what its last stop asked: the judge of a drive, and that of the
outputs of a node. Sans-IO."""
