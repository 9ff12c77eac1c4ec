"""The demonstrations: the paper's figure, and the closed loop."""
