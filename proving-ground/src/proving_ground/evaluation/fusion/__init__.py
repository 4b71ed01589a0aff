"""Fusion scored: sources on and off, two feet, ranges, spoofers, damages, rooms, honesty; its pages."""
