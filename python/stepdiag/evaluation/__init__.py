"""The judged evaluation of a run: what the commands, the pages and the library take verdicts from."""
