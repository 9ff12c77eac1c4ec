"""Readings from an instrument: triggers, settling, raw files, and the simulated instrument."""
