"""netCDF-4 files: written completely or not at all, and checked when read.

labelled_tables.py, netcdf_read.py and docs/files.md describe their contents.
"""

import hashlib
import mmap
import os
import secrets
import struct
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import numpy.typing as npt

from stepdiag import platform
from stepdiag._core import InvalidArgument, __version__, newer_format
from stepdiag.interruption import at_end, uninterrupted
from stepdiag.io.labelled import LabelledArray, LabelledTable
from stepdiag.io.whole_files import check_output, read_bytes, write_whole

# A file may declare this much, plus a hundred times its size: compression is limited.
_FREE_SIZE = 64 * 2**20
_LARGEST_COMPRESSION = 100

_ROOM = 2**19  # bytes of a file beside its values, at most
_CHECKSUM = "sha256"
_OF_OTHERS = ("history",)  # attributes that other programs add to, as their conventions want
# Attributes that say how values are stored; they are no part of what a file says.
_OF_STORAGE = ("_Encoding", "_FillValue", "_Unsigned", "add_offset", "coordinates", "missing_value", "scale_factor")
_LIBRARIES = threading.RLock()  # HDF5 crashes where two threads use it at once
_FILL = netCDF4.default_fillvals["f8"]  # netCDF's mark of values never written


def write_netcdf(table: LabelledTable, path: Path, attributes: dict[str, Any]) -> None:
    """Write a table, with these global attributes before its own.

    Texts are stored as characters. The attribute `sha256` is the checksum of all values and
    attributes; arrays get Fletcher-32 too, which every netCDF library checks. Raises
    InvalidArgument if the file cannot be written."""
    first = {"Conventions": "CF-1.11", "source": f"stepdiag {__version__}"} | attributes
    attrs = first | table.attrs | first  # the order of the first, and their values
    attrs[_CHECKSUM] = _checksum(attrs, table.variables)
    check_output(path)
    try:
        content = _packed(table, attrs, path)
    except (OSError, RuntimeError) as error:  # RuntimeError: of the C libraries
        raise InvalidArgument(f"{path}: cannot be written: {_one_line(error)}") from None
    write_whole(path, content)


def _packed(table: LabelledTable, attrs: Mapping[str, Any], path: Path) -> memoryview:
    """The content of a file, made in memory if there is room, else beside `path`: where a disk fails, the C libraries
    crash."""
    # An exception inside of the libraries leaves their locks taken.
    with _LIBRARIES, uninterrupted(), ExitStack() as stack:
        size = sum(variable.values.nbytes for variable in table.variables.values()) + _ROOM
        try:
            scratch, handle = stack.enter_context(_scratch(platform.memory_folder() or path.parent, size))
        except OSError:
            scratch, handle = stack.enter_context(_scratch(path.parent, size))
        file = netCDF4.Dataset(scratch, "w", format="NETCDF4")  # not with memory=, which forgets the variables' order
        if platform.OPEN_FILES_CAN_GO:
            scratch.unlink()
        _dump(table, attrs, file)
        file.close()
        if not platform.OPEN_FILES_CAN_GO:
            return memoryview(scratch.read_bytes())
        return memoryview(mmap.mmap(handle, 0, access=mmap.ACCESS_READ))


def _dump(table: LabelledTable, attrs: Mapping[str, Any], file: netCDF4.Dataset) -> None:
    """By the CF conventions: a variable names its coordinates, the table those of no variable."""
    along = {name for name in table.coordinates if table.variables[name].dims == (name,)}
    others = {name: set(table.variables[name].dims) for name in sorted(table.coordinates - along)}
    unnamed = set(others)
    for name, (dims, values, stated) in table.variables.items():
        own = {}
        if name not in table.coordinates:
            named = [other for other, needed in others.items() if needed <= {*dims}]
            unnamed -= {*named}
            own = {"coordinates": " ".join(named)} if named else {}
        fill = np.nan if values.dtype.kind == "f" and np.isnan(values).any() else None
        if values.dtype.kind in "US":
            dims, values = (*dims, f"{name}_length"), _characters(values)
            own["_Encoding"] = "utf-8"
        for dimension, length in zip(dims, values.shape, strict=True):
            if dimension not in file.dimensions:
                file.createDimension(dimension, length)
        variable = file.createVariable(name, values.dtype, dims, fletcher32=bool(dims), fill_value=fill)
        variable.set_auto_maskandscale(False)
        variable.setncatts({**stated, **own})
        variable[...] = values
    file.setncatts({**attrs, **({"coordinates": " ".join(sorted(unnamed))} if unnamed else {})})


def _characters(texts: npt.NDArray[Any]) -> npt.NDArray[np.bytes_]:
    """Texts in UTF-8, their characters along one more dimension."""
    encoded = np.ascontiguousarray(np.char.encode(texts, "utf-8") if texts.dtype.kind == "U" else texts)
    return encoded.view("S1").reshape(*texts.shape, encoded.dtype.itemsize)


@contextmanager
def _scratch(folder: Path, size: int) -> Iterator[tuple[Path, int]]:
    """A file of so many bytes and its descriptor. Raises OSError if there is no room."""
    path = folder / f"stepdiag.{secrets.token_hex(8)}"
    with at_end(partial(path.unlink, missing_ok=True)):
        handle = platform.open_new(path)
        try:
            platform.reserve(handle, size)
            yield path, handle
        finally:
            os.close(handle)
            path.unlink(missing_ok=True)


def read_netcdf(path: Path) -> "NetcdfFile":
    """A netCDF file. Raises InvalidArgument naming the file for any fault in it."""
    content = read_bytes(path)
    _check_heaps(content, path)
    with _LIBRARIES:
        try:
            with netCDF4.Dataset("memory.nc", memory=content) as file:
                _check_size(file, len(content), path)
                found = NetcdfFile(path, *_loaded(file))
        except InvalidArgument:
            raise
        except Exception as error:  # the libraries raise anything for a damaged file
            raise InvalidArgument(f"{path}: expected a netCDF file: {_one_line(error)}") from None
    found.check()
    return found


def _loaded(file: netCDF4.Dataset) -> tuple[LabelledTable, dict[str, str]]:
    """What is in a file, and why variables cannot be read."""
    table, damaged = LabelledTable({}, {}, _attributes(file)), {}
    for name, variable in file.variables.items():
        values = np.empty(0)
        try:
            values = _values(variable)
        except Exception as error:  # such as a wrong checksum
            damaged[name] = _one_line(error)
        table.variables[name] = LabelledArray(variable.dimensions[: values.ndim], values, _attributes(variable))
    return table, damaged


def _attributes(of: Any) -> dict[str, Any]:
    return {name: of.getncattr(name) for name in of.ncattrs() if name not in _OF_STORAGE}


def _values(variable: "netCDF4.Variable[Any]") -> npt.NDArray[Any]:
    """As the library decodes them; missing numbers are NaN, and characters whose encoding is not named are texts,
    too."""
    variable.set_auto_maskandscale(variable.dtype != "S1")
    values = np.asanyarray(variable[...])
    if values.dtype == "S1" and values.ndim:
        return np.asarray(netCDF4.chartostring(values, encoding="bytes"))
    if np.ma.is_masked(values) and values.dtype.kind in "fiu":
        return np.asarray(values.astype(np.float64).filled(np.nan))
    return np.asarray(np.ma.getdata(values))


class NetcdfFile:
    """Checked access to the variables and attributes of a file."""

    def __init__(self, path: Path, table: LabelledTable, damaged: Mapping[str, str] | None = None) -> None:
        """`damaged`: why variables cannot be read."""
        self.path = path
        self._table = table
        self._damaged = damaged or {}

    def check_format(self, expected: str) -> None:
        """Check the attribute `format`, which files of other programs may lack. Raises InvalidArgument."""
        given = self.text("format", expected)
        if given != expected:
            raise self.fail("attribute format", f'expected "{expected}", got "{given}"{newer_format(expected, given)}')

    @property
    def has_checksum(self) -> bool:
        return _CHECKSUM in self._table.attrs

    def check(self) -> None:
        """Compare the content with the checksum of the file, if it has one. Raises InvalidArgument."""
        expected = self._table.attrs.get(_CHECKSUM)
        if expected is None:
            return
        for name in self.names:
            self._load(name)
        found = _checksum(self._table.attrs, self._table.variables)
        if expected != found:
            raise self.fail(
                f"attribute {_CHECKSUM}",
                f"expected {_show(expected)}, got {found}; the file was damaged or changed: "
                "without this attribute it is read as it is, a calibration as unverified",
            )

    def __contains__(self, name: str) -> bool:
        return name in self._table.variables

    @property
    def names(self) -> list[str]:
        return list(self._table.variables)

    def fail(self, name: str, message: str) -> InvalidArgument:
        return InvalidArgument(f"{self.path}: {name}: {message}")

    def dimensions(self, name: str) -> tuple[str, ...]:
        return self._variable(name).dims

    def numbers(
        self,
        name: str,
        dimensions: Sequence[str],
        units: str | None,
        *,
        missing: bool = False,
        infinite: bool = False,
    ) -> npt.NDArray[np.float64]:
        """A variable with these dimensions and units, as doubles; NaN only if `missing`, infinite ones likewise."""
        variable = self._variable(name, dimensions)
        stored = self._load(name)
        if stored.dtype.kind not in "fiu":
            raise self.fail(name, f"expected numbers, got values of type {stored.dtype}")
        given = variable.attrs.get("units")
        if units is not None and not (isinstance(given, str) and given == units):
            raise self.fail(name, f'units: expected "{units}", got {_show(given)}')
        values = np.array(stored, dtype=np.float64)
        values[values == _FILL] = np.nan
        if not infinite and np.isinf(values).any():
            raise self.fail(name, "expected finite numbers, got an infinite one")
        if not missing and np.isnan(values).any():
            raise self.fail(name, f"expected finite numbers, but value {int(np.argmax(np.isnan(values)))} is missing")
        return values

    def integers(self, name: str, dimensions: Sequence[str]) -> list[int]:
        self._variable(name, dimensions)
        values = self._load(name)
        if values.dtype.kind not in "iu":
            raise self.fail(name, f"expected whole numbers, none missing, got values of type {values.dtype}")
        return [int(value) for value in values]

    def texts(self, name: str, dimensions: Sequence[str]) -> list[str]:
        self._variable(name, dimensions)
        values = self._load(name).tolist()
        if not all(isinstance(value, str | bytes) for value in values):
            raise self.fail(name, "expected texts")
        try:
            return [value.decode() if isinstance(value, bytes) else value for value in values]
        except UnicodeDecodeError:
            raise self.fail(name, "expected UTF-8 text") from None

    def text(self, attribute: str, default: str | None = None, *, of: str | None = None) -> str:
        """A text: a global attribute, or an attribute of the variable `of`."""
        where = self._table.attrs if of is None else self._variable(of).attrs
        name = f"attribute {attribute}" if of is None else f"{of}: attribute {attribute}"
        value = where.get(attribute, default)
        if value is None:
            raise self.fail(name, "missing")
        if not isinstance(value, str):
            raise self.fail(name, f"expected a text, got {_show(value)}")
        return value

    def lengths(self, attribute: str) -> npt.NDArray[np.float64]:
        """A global attribute with three numbers, as a rule lengths."""
        value = self._table.attrs.get(attribute)
        if value is None:
            raise self.fail(f"attribute {attribute}", "missing")
        lengths = np.asarray(value)
        if lengths.dtype.kind not in "fiu" or lengths.shape != (3,):
            raise self.fail(f"attribute {attribute}", f"expected three numbers, got {_show(value)}")
        return lengths.astype(np.float64)

    def lengths_if_there(self, attribute: str) -> npt.NDArray[np.float64] | None:
        return self.lengths(attribute) if attribute in self._table.attrs else None

    def number(self, attribute: str) -> float | None:
        """A global attribute with a number; None if it is missing."""
        value = self._table.attrs.get(attribute)
        if value is None:
            return None
        number = np.asarray(value)
        if number.dtype.kind not in "fiu" or number.size != 1:
            raise self.fail(f"attribute {attribute}", f"expected a number, got {_show(value)}")
        return float(number.reshape(()))

    def _variable(self, name: str, dimensions: Sequence[str] | None = None) -> LabelledArray:
        if name not in self._table.variables:
            raise self.fail(name, "the variable is missing")
        variable = self._table.variables[name]
        if dimensions is not None and variable.dims != tuple(dimensions):
            wanted, given = (f"({', '.join(dims)})" for dims in (dimensions, variable.dims))
            raise self.fail(name, f"expected the dimensions {wanted}, got {given}")
        return variable

    def _load(self, name: str) -> npt.NDArray[Any]:
        if name in self._damaged:
            raise self.fail(name, f"cannot be read: {self._damaged[name]}")
        return self._variable(name).values


def _checksum(attributes: Mapping[str, Any], variables: Mapping[str, LabelledArray]) -> str:
    """SHA-256 of all attributes and of the variables with their dimensions, in the order of their names.

    A name is followed by its values: numbers as little-endian doubles, NaN as NumPy's, texts in
    UTF-8, each text ended by a zero byte. docs/files.md describes it for other programs."""
    digest = hashlib.sha256()

    def add(name: str, value: Any) -> None:
        digest.update(name.encode() + b"\0")
        values = np.atleast_1d(np.asarray(value))
        if values.dtype.kind in "fiub":
            numbers = values.astype("<f8")
            numbers[np.isnan(numbers)] = np.nan
            digest.update(numbers.tobytes())
            return
        for text in values.ravel().tolist():
            digest.update((text if isinstance(text, bytes) else str(text).encode()) + b"\0")

    def add_attributes(owner: str, own: Mapping[str, Any]) -> None:
        for key in sorted(own):
            if key not in (_CHECKSUM, *_OF_OTHERS):
                add(f"{owner}:{key}", own[key])

    add_attributes("", attributes)
    for name in sorted(variables):
        variable = variables[name]
        add(f"{name}({','.join(variable.dims)})", variable.values)
        add_attributes(name, variable.attrs)
    return digest.hexdigest()


def _check_size(file: netCDF4.Dataset, size: int, path: Path) -> None:
    """Refuse a file that declares far more values than its size can hold, to protect the memory."""
    declared = sum(v.size * max(np.dtype(v.dtype).itemsize, 16) for v in file.variables.values())
    if declared > _FREE_SIZE + _LARGEST_COMPRESSION * size:
        raise InvalidArgument(f"{path}: declares {declared / 2**20:.0f} MiB of values, but has {size / 2**20:.3g} MiB")


def _check_heaps(content: bytes, path: Path) -> None:
    """Check the sizes of HDF5's global heaps: the library loops forever over damaged ones."""
    signature = b"GCOL\x01\0\0\0"  # including the version
    start = content.find(signature)
    while start >= 0:
        size = struct.unpack_from("<Q", content, start + 8)[0] if start + 16 <= len(content) else 0
        sound = 16 <= size <= len(content) - start
        at, end = start + 16, start + size
        while sound and at + 16 <= end:
            index, length = struct.unpack_from("<H6xQ", content, at)
            step = length if index == 0 else 16 + (length + 7) // 8 * 8  # 0: free space
            at += step
            sound = step >= 16 and at <= end
        if not sound:
            raise InvalidArgument(f"{path}: expected a netCDF file: a heap in it is damaged")
        start = content.find(signature, start + 8)


def _show(value: Any) -> str:
    if value is None:
        return "none"
    text = f'"{value}"' if isinstance(value, str) else " ".join(str(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def _one_line(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(text).split())[:200]
