"""Figures of ISO 230-2 and ISO 230-6 along a line: from repeated readings, or predicted from a calibration."""
