"""Commands for the person at the machine: alignment, acquisition, and the twin."""
