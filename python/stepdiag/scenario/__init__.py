"""Scenarios: from checked keys to the core's values, and the order in which a run is measured."""
