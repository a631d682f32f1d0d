"""Parameters of drives, read and written by SDO."""
