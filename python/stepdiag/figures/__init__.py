"""Figures of results, in the common style of style.py."""
