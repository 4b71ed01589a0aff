"""Exercises, recorded data sets, scoring and load tests: where the system is tried and measured."""
