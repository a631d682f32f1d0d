"""Sources of the page beside the plant: buses, captures, the system."""
