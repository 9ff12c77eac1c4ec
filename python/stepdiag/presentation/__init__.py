"""What is said of results, as text."""
