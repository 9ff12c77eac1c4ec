"""Described heads: read, check, draw, and their sensitivities. shipped/ has the package's own."""
