"""Readings from an instrument: when to read, what was read, and the simulated instrument."""
