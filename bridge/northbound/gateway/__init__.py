"""The ASCII gateway after CiA 309-3 (version 3.0): foreign tools on the bridge's own SDO queue and rights."""
