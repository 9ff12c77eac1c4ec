"""Uncertainty of a calibration: propagation, virtual calibrations, studies of many scenarios."""
