"""How to make a sample model, as a plain value: what is computed from it is a pure function of it."""

import threading
from collections import OrderedDict
from typing import Final, Protocol

from stepdiag._core import SampleModel

KEPT: Final = 2  # models that a process keeps: the last ones asked for


class Recipe(Protocol):
    """Hashable, and picklable by what it is made of."""

    def model(self) -> SampleModel: ...


_models: OrderedDict[Recipe, SampleModel] = OrderedDict()
_lock = threading.Lock()


def model_of(recipe: Recipe) -> SampleModel:
    """The model of a recipe, made once a process."""
    with _lock:  # also while it is made: others that want the same one wait for it
        model = _models.pop(recipe, None) or recipe.model()
        _models[recipe] = model
        while len(_models) > KEPT:
            _models.popitem(last=False)
        return model
