"""Exercises in one process and in event time: the same cores, as fast as they go, the same bytes each time."""
