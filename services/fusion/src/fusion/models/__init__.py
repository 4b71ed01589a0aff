"""Propagation and measurement models: each a function of the state with its Jacobian, apart from the filter."""
