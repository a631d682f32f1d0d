"""A drive of CiA 402 in its modes."""
