"""Which mistake would explain that readings and scenario disagree: changed copies of both, adjusted and compared."""
