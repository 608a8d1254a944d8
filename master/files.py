"""Datasets to files and back, in one piece or not at all."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import h5netcdf
import numpy as np
import xarray as xr

from railcosim.storage.patient_file import PatientFile
from railcosim.storage.whole import written_whole

_PARTS = {"re": np.real, "im": np.imag}
_Function = TypeVar("_Function")
_NAME = "name"
"""Attribute of a variable whose name HDF5 would take for a path: the name."""
_NO_UNIT = "-"
_UNITS = "# units: "


def save(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a dataset to a file.

    A complex variable NAME is stored as two, ``NAME.re`` and ``NAME.im``: netCDF has no portable
    complex numbers. An existing file is replaced only when the new one is complete.

    Parameters
    ----------
    dataset : xarray.Dataset
        For CSV: variables along one dimension, the same for all.
    path : str or Path
        ``.nc`` (netCDF 4, keeps the attributes) or ``.csv`` (a line of units, a line of names,
        the numbers in full precision, the dimension perhaps in words; drops attributes and other
        coordinates).

    Raises
    ------
    ValueError
        For another suffix, or a dataset that CSV cannot hold.
    """
    path = Path(path)
    write = _choose(path, _WRITERS)
    with written_whole(path) as partial:
        write(dataset, partial)


def load(path: str | Path) -> xr.Dataset:
    """Read a file that `save` wrote, complex variables included.

    Parameters
    ----------
    path : str or Path
        ``.nc`` or ``.csv``.

    Returns
    -------
    xarray.Dataset
        All of it in memory.

    Raises
    ------
    ValueError
        For another suffix, or a CSV file without the line of units.
    """
    path = Path(path)
    return _choose(path, _READERS)(path)


def _write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write netCDF 4."""
    split = _split_complex(dataset)
    split.attrs = _attributes(split.attrs)
    for name, variable in split.variables.items():
        variable.attrs = _attributes(variable.attrs)
        if "/" in str(name):
            variable.attrs[_NAME] = str(name)
    split = split.rename({n: str(n).replace("/", "%2F") for n in split.variables if "/" in str(n)})
    with path.open("w+b") as file:
        sink = PatientFile(file)
        with h5netcdf.File(sink, "w") as target:
            split.dump_to_store(xr.backends.H5NetCDFStore(target))
        sink.end()


def _read_netcdf(path: Path) -> xr.Dataset:
    """Read netCDF 4 or 3."""
    with path.open("rb") as file:
        is_classic = file.read(3) == b"CDF"  # netCDF 3, as results beside a checkpoint
    with xr.open_dataset(path, engine="scipy" if is_classic else "h5netcdf") as file:
        dataset = file.load()
    names = {n: v.attrs.pop(_NAME) for n, v in dataset.variables.items() if _NAME in v.attrs}
    return _join_complex(dataset.rename(names))


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write one column for the dimension, and one for each variable or part of one."""
    if len(dataset.dims) != 1 or any(v.ndim != 1 for v in dataset.data_vars.values()):
        dims = ", ".join(map(str, dataset.dims)) or "none"
        raise ValueError(f"CSV holds one dimension for all, here are {dims}; save it as .nc")
    split = _split_complex(dataset)
    dim = str(next(iter(split.dims)))
    columns: list[xr.DataArray] = [split[dim], *split.data_vars.values()]
    units = ", ".join(f"{c.name} {c.attrs.get('units') or _NO_UNIT}" for c in columns)
    words = split[dim].dtype.kind in "UO"
    numbers = columns[1:] if words else columns
    table = np.column_stack([np.asarray(c.values, dtype=float) for c in numbers])
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"{_UNITS}{units}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([str(c.name) for c in columns])
        if words:
            rows = zip(split[dim].values, table, strict=True)
            writer.writerows([word, *(f"{x:.17g}" for x in row)] for word, row in rows)
        else:
            np.savetxt(file, table, fmt="%.17g", delimiter=",")  # 17 digits give back the same bits


def _read_csv(path: Path) -> xr.Dataset:
    """Read the columns; the first is the dimension."""
    with path.open(encoding="utf-8", newline="") as file:
        first = file.readline()
        if not first.startswith(_UNITS):
            raise ValueError(f"{path}: its first line must start with {_UNITS!r}")
        names = next(csv.reader(file))
        values = _columns(file)
    dim, *others = names
    units = _parse_units(first.removeprefix(_UNITS).rstrip("\n"), names)
    columns = {
        name: (dim, column, {"units": units[name]} if units[name] else {})
        for name, column in zip(names, values, strict=True)
    }
    dataset = xr.Dataset({name: columns[name] for name in others}, {dim: columns[dim]})
    for name in others:
        stem, _, part = name.rpartition(".")
        if {f"{stem}.re", f"{stem}.im"} <= set(others):
            dataset[name].attrs["complex_part"] = part
    return _join_complex(dataset)


def _columns(lines: Iterable[str]) -> list[np.ndarray]:
    """Columns of numbers; the first perhaps of words."""
    lines = iter(lines)
    first = next(lines, "")
    try:
        float(first.partition(",")[0])
    except ValueError:
        rows = list(csv.reader(chain([first], lines)))
        numbers = np.array([row[1:] for row in rows], dtype=float)
        return [np.array([row[0] for row in rows]), *numbers.T]
    return list(np.loadtxt(chain([first], lines), delimiter=",", ndmin=2).T)


def _parse_units(text: str, names: list[str]) -> dict[str, str]:
    """Take ``a m, b N, c -`` apart; names and units may hold blanks and commas themselves."""
    starts = []
    position = 0
    for name in names:
        position = text.index(f"{name} ", position)
        starts.append((position, position + len(name) + 1))
        position += len(name)
    ends = [begin - len(", ") for begin, _ in starts[1:]] + [len(text)]
    units = [text[begin:end] for (_, begin), end in zip(starts, ends, strict=True)]
    return {n: "" if u == _NO_UNIT else u for n, u in zip(names, units, strict=True)}


def _split_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Replace every complex variable by its two parts, each marked in an attribute."""
    result = dataset.copy()
    for name in [n for n, v in dataset.data_vars.items() if np.iscomplexobj(v)]:
        variable = dataset[name]
        for part, take in _PARTS.items():
            attrs = {**variable.attrs, "complex_part": part}
            result[f"{name}.{part}"] = (variable.dims, take(variable.values), attrs)
    return result.drop_vars([n for n, v in result.data_vars.items() if np.iscomplexobj(v)])


def _join_complex(dataset: xr.Dataset) -> xr.Dataset:
    """Undo `_split_complex`."""
    result = xr.Dataset(coords=dataset.coords, attrs=dataset.attrs)
    for key, variable in dataset.data_vars.items():
        name = str(key)
        part = variable.attrs.get("complex_part")
        if part is None:
            result[name] = variable
        elif part == "re":
            stem = name.removesuffix(".re")
            attrs = {k: v for k, v in variable.attrs.items() if k != "complex_part"}
            values = variable.values + 1j * dataset[f"{stem}.im"].values
            result[stem] = (variable.dims, values, attrs)
    return result


def _attributes(attrs: dict[Any, Any]) -> dict[str, Any]:
    """Make attributes something netCDF can store."""
    return {str(key): _attribute(value) for key, value in attrs.items()}


def _attribute(value: Any) -> Any:
    """Keep text, numbers and arrays; make JSON of anything else."""
    if isinstance(value, str | np.ndarray | np.number) or type(value) in {int, float}:
        return value
    return json.dumps(value, default=str)


def _choose(path: Path, table: dict[str, _Function]) -> _Function:
    """Find the function for a file's suffix."""
    try:
        return table[path.suffix.lower()]
    except KeyError:
        allowed = " or ".join(table)
        raise ValueError(f"{path}: the suffix must be {allowed}, got {path.suffix!r}") from None


_WRITERS: dict[str, Callable[[xr.Dataset, Path], None]] = {".nc": _write_netcdf, ".csv": _write_csv}
_READERS: dict[str, Callable[[Path], xr.Dataset]] = {".nc": _read_netcdf, ".csv": _read_csv}
