"""One CANopen node and the drives behind it: boot-up, process data, parameters, error control."""
