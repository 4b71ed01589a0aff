"""Exercises: several soldiers at once, on stage as real processes, watched, scored and shown."""
