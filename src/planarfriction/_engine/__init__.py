"""Private machinery behind the models: compiled loops over the formulas, in rooms that import only downwards."""
