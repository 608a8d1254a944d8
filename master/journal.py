"""Rows of numbers in a netCDF file that grows, and that can be opened at any moment.

A file of netCDF 3 is a header, which holds the number of records, and the records. A block is
written behind the last record, and only then the number is changed, 4 bytes at once. Whenever the
process is killed, the file is complete with what was there before or after. (HDF5, which is netCDF
4, keeps tables that are wrong in between.) Each row is written once, however long the run gets.
"""

from __future__ import annotations

import os
import string
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

import numpy as np
import xarray as xr
from scipy.io import netcdf_file

from railcosim.master.component import FloatArray

_COUNT_AT = 4  # bytes from the beginning of the file: the number of records
_ID = "railcosim_run"


class Journal:
    """A file of rows: what a recorder has kept.

    Parameters
    ----------
    path : Path
        The file; replaced as a whole.
    columns : xarray.Dataset
        The variables along ``time``, for their names and attributes.
    identity : str
        Of the run, to tell its rows from others'.
    rows : array, shape (n, 1 + n_variables)
        What is known already; time first.
    """

    def __init__(self, path: Path, columns: xr.Dataset, identity: str, rows: FloatArray) -> None:
        self._path = path
        partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
        try:
            _write_header(partial, columns, identity)
            self._begin = partial.stat().st_size - 8 * rows.shape[1]
            _append(partial, self._begin, 0, rows)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)
        self._count = len(rows)

    def __len__(self) -> int:
        return self._count

    def append(self, rows: FloatArray) -> None:
        """Add rows, shape (n, 1 + n_variables)."""
        if len(rows):
            _append(self._path, self._begin, self._count, rows)
            self._count += len(rows)


def read_journal(path: Path, columns: xr.Dataset, identity: str, n_rows: int) -> FloatArray:
    """Read the first rows of a `Journal`.

    Parameters
    ----------
    path, columns, identity
        As it was written.
    n_rows : int
        How many.

    Returns
    -------
    array, shape (n_rows, 1 + n_variables)
        Time and values.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is damaged, of another run, or has too few rows.
    """
    try:
        with netcdf_file(path, mmap=False) as file:
            found = getattr(file, _ID, b"").decode("ascii", "replace")
            names = _names(columns)
            known = all(name in file.variables for name in names)
            rows = np.column_stack([file.variables[n][:n_rows] for n in names]) if known else None
    except (TypeError, KeyError, IndexError, AttributeError, EOFError, MemoryError) as error:
        raise ValueError(f"it is damaged ({error})") from error
    if found != identity or rows is None:
        raise ValueError("it is of another run")
    if len(rows) != n_rows:
        raise ValueError(f"it has {len(rows)} points and not {n_rows}")
    return rows.astype(np.float64)  # from the order of bytes in the file


def _names(columns: xr.Dataset) -> list[str]:
    """Names of all columns, in ASCII as netCDF 3 wants them."""
    return [quote(str(name), safe=string.printable) for name in ("time", *columns.data_vars)]


def _write_header(path: Path, columns: xr.Dataset, identity: str) -> None:
    """Write a file with one row, to be written over: scipy sizes records by the first."""
    attributes: Mapping[str, object] = columns.attrs
    with netcdf_file(path, "w", version=2) as file:
        file.createDimension("time", None)
        for key, value in {**attributes, _ID: identity}.items():
            setattr(file, str(key), str(value).encode())
        for name, column in zip(_names(columns), ("time", *columns.data_vars), strict=True):
            variable = file.createVariable(name, "d", ("time",))
            variable[0] = 0.0
            for key, value in columns[column].attrs.items():
                setattr(variable, str(key), str(value).encode())


def _append(path: Path, begin: int, count: int, rows: FloatArray) -> None:
    """Write rows behind `count` others, and then their number; each reaches the disk in turn."""
    with path.open("r+b") as file:
        file.seek(begin + count * rows.shape[1] * 8)
        file.write(rows.astype(">f8").tobytes())
        file.flush()
        os.fsync(file.fileno())
        file.seek(_COUNT_AT)
        file.write((count + len(rows)).to_bytes(4, "big"))
        file.flush()
        os.fsync(file.fileno())
