"""Alignment of head and mirror: what to turn, from readings at a few places of the machine."""
