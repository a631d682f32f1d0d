"""The flight recorder: all that goes into the core of the bus process and comes out of it, turn by turn, so
that an incident can be looked at and replayed."""
