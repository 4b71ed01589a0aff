"""Simulated people and their sensors."""
