"""Calibrations in the formats of controllers."""
