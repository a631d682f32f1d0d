"""Process data: PDOs in and out, as the node maps them, and the words that stop a drive."""
