"""Measuring programs for controllers (G-code)."""
