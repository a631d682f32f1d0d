"""What is asked of a drive or an output, and what is told of it."""
