"""Past values, black boxes of trips, and the files they are read by."""
