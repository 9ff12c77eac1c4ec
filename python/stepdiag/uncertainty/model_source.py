"""Where a sample model comes from, as a plain value: what is computed from the model is a pure function of it."""

import threading
from collections import OrderedDict
from typing import Final, Protocol

from stepdiag._core import SampleModel

KEPT: Final = 2  # models that a process keeps: the last ones asked for


class ModelSource(Protocol):
    """Hashable, and picklable by what it is made of."""

    def model(self) -> SampleModel: ...


_models: OrderedDict[ModelSource, SampleModel] = OrderedDict()
_lock = threading.Lock()


def model_of(source: ModelSource) -> SampleModel:
    """The model of a source, made once a process."""
    with _lock:  # also while it is made: others that want the same one wait for it
        model = _models.pop(source, None) or source.model()
        _models[source] = model
        while len(_models) > KEPT:
            _models.popitem(last=False)
        return model
