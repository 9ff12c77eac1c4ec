"""What was found, in words: every sentence is a pure function of findings. The core gives findings as data."""
