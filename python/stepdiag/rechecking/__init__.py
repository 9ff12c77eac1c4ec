"""Is the last calibration still valid: new readings against it."""
