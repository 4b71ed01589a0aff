"""Estimators scored on recorded runs: alignment to truth, error figures, consistency of covariances, plots."""
