"""Uncertainty of a calibration: propagation, virtual calibrations by the million, studies of many scenarios."""
