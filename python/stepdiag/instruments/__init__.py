"""Instruments that give readings: attocube IDS3010, and whatever an adapter sends as lines."""
