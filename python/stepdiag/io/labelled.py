"""Arrays with named dimensions, and attributes: what tables are made of, and netCDF files hold.

They are those of xarray, whose import takes longer than most commands: it is made of them where somebody asks.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray


class LabelledArray(NamedTuple):
    dims: tuple[str, ...]
    values: npt.NDArray[Any]
    attrs: dict[str, Any]


class LabelledTable:
    """Arrays by name, some of them coordinates of the others.

    variables, coordinates: dimension or dimensions, values, attributes. attrs: of the table."""

    def __init__(self, variables: Mapping[str, Any], coordinates: Mapping[str, Any], attrs: Mapping[str, Any]) -> None:
        self.variables: dict[str, LabelledArray] = {}
        self.coordinates = frozenset(coordinates)
        self.attrs = dict(attrs)
        self.add({**variables, **coordinates})

    @classmethod
    def of(cls, dataset: "xarray.Dataset") -> "LabelledTable":
        def parts(given: Any) -> dict[str, Any]:
            return {str(name): (one.dims, one.values, one.attrs) for name, one in given.items()}

        return cls(parts(dataset.data_vars), parts(dataset.coords), dataset.attrs)

    def add(self, variables: Mapping[str, Any]) -> None:
        for name, (dims, values, attrs) in variables.items():
            along = (dims,) if isinstance(dims, str) else tuple(map(str, dims))
            self.variables[name] = LabelledArray(along, np.asarray(values), dict(attrs))

    def to_xarray(self) -> "xarray.Dataset":
        import xarray

        coordinates = {name: tuple(one) for name, one in self.variables.items() if name in self.coordinates}
        variables = {name: tuple(one) for name, one in self.variables.items() if name not in self.coordinates}
        return xarray.Dataset(variables, coordinates, self.attrs)
