"""Sheets as people keep them, made into measurements: the only lenient reader (docs/import.md)."""
