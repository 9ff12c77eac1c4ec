"""The 21 parameters by name, as Python and the core have them."""

import stepdiag as sd
from stepdiag.parameters import FUNCTIONS, SQUARENESSES


def test_names_are_those_of_the_core() -> None:
    errors = sd.random_error_map((800.0, 600.0, 500.0), seed=1)
    assert (sorted(errors.functions), sorted(errors.squareness)) == (sorted(FUNCTIONS), sorted(SQUARENESSES))
