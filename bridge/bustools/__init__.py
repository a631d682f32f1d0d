"""Bus tasks: the work of single commands on a bus."""
