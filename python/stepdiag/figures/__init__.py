"""Pictures of results, in the one style of style.py."""
