"""State-space forms of a model, and the way from each to any other."""
