"""The ASCII gateway after CiA 309-3: foreign tools on the bridge's own SDO queue and rights."""
