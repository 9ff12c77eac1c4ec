"""Before anyone measures: what a plan determines, and how long it takes."""
