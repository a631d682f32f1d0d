"""Published models: drives as assets of Powertrain, DI and Machinery, and the file of all nodes."""
