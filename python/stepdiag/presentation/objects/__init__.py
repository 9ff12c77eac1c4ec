"""Results as plain dicts, for programs: one module for each command that has --json. docs/json.md explains them."""
