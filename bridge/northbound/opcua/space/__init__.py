"""Address space of the points: their layout, made into nodes when somebody looks."""
