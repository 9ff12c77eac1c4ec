"""What follows from the values of a calibration: comparison, deviations from a truth, the functional point."""
