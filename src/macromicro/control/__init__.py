"""Controllers: pure functions of parameters, state, reference and measurement."""
