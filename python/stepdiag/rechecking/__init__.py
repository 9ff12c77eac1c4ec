"""Is the last calibration still true: new readings against it."""
