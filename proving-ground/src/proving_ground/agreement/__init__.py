"""Simulated against recorded: strides, signals and the foot INS's errors of both, and whether they agree."""
