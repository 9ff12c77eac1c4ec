"""Described heads: read, checked, drawn, and how sensitive their readings are. shipped/ holds those of the package."""
