"""The controller leg of one drive as one machine: its stages, the table that joins them, and its words."""
