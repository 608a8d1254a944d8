"""Rows of numbers in a netCDF file that grows, and that can be opened at any moment.

A file of netCDF 3 is a header, which holds the number of records, and the records. A block is
written behind the last record, and only then the number is changed, 4 bytes at once. Whenever the
process is killed, the file is complete with what was there before or after. (HDF5, which is netCDF
4, keeps tables that are wrong in between.) Each row is written once, however long the run gets.

Whether a file is still what was written is known by its seals: digests of all bytes up to some
places, kept elsewhere.
"""

from __future__ import annotations

import hashlib
import os
import string
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import quote

import numpy as np
import scipy
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.storage.whole import check_regular, written_whole

Seals: TypeAlias = tuple[tuple[int, str], ...]
"""Places in a file, bytes from its beginning, each with a digest of all before it."""

_COUNT_AT = 4  # bytes from the beginning of the file: the number of records
_COUNT_END = 8
_ID = "railcosim_run"
_HEADER = 1 << 20  # bytes from the beginning, in which a journal says that it is one
_MOST_SEALS = 512


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
        with written_whole(path) as partial:
            _write_header(partial, columns, identity)
            begin = partial.stat().st_size - 8 * rows.shape[1]
            with partial.open("rb") as file:
                self._sum = _sum_of_header(file.read(begin))
            self._seals: list[tuple[int, str]] = [(begin, self._sum.hexdigest())]
            self._count = 0
            self._append(partial, rows)

    def __len__(self) -> int:
        return self._count

    @property
    def seals(self) -> Seals:
        """By which `read_journal` sees whether all is as it was written."""
        return tuple(self._seals)

    def append(self, rows: FloatArray) -> None:
        """Add rows, shape (n, 1 + n_variables)."""
        if len(rows):
            self._append(self._path, rows)

    def _append(self, path: Path, rows: FloatArray) -> None:
        """Write rows, and then their number; each reaches the disk in turn."""
        data, end = rows.astype(">f8").tobytes(), self._seals[-1][0]
        with path.open("r+b") as file:
            file.seek(end)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
            file.seek(_COUNT_AT)
            file.write((self._count + len(rows)).to_bytes(4, "big"))
            file.flush()
            os.fsync(file.fileno())
        self._count += len(rows)
        self._sum.update(data)
        self._seals.append((end + len(data), self._sum.hexdigest()))
        if len(self._seals) > _MOST_SEALS:  # they only say more closely where the damage is
            del self._seals[1:-1:2]


def is_journal(path: Path) -> bool:
    """Whether a file is a journal, of whatever run."""
    with path.open("rb") as file:
        begin = file.read(_HEADER)
    return begin.startswith(b"CDF") and _ID.encode() in begin


def read_journal(
    path: Path, columns: xr.Dataset, identity: str, n_rows: int, seals: Seals
) -> FloatArray:
    """Read the first rows of a `Journal`.

    Parameters
    ----------
    path, columns, identity
        As it was written.
    n_rows : int
        How many.
    seals : Seals
        As they were when there were so many.

    Returns
    -------
    array, shape (n_rows, 1 + n_variables)
        Time and values.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is damaged, and where; of another run, or has too few rows.
    """
    _check_seals(path, seals, n_rows)
    try:
        with scipy.io.netcdf_file(path, mmap=False) as file:
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
    with scipy.io.netcdf_file(path, "w", version=2) as file:
        file.createDimension("time", None)
        for key, value in {**attributes, _ID: identity}.items():
            setattr(file, str(key), str(value).encode())
        for name, column in zip(_names(columns), ("time", *columns.data_vars), strict=True):
            variable = file.createVariable(name, "d", ("time",))
            variable[0] = 0.0
            for key, value in columns[column].attrs.items():
                setattr(variable, str(key), str(value).encode())


def _sum_of_header(header: bytes) -> Any:
    """Digest of a header but for the number of records in it."""
    return hashlib.sha256(header[:_COUNT_AT] + header[_COUNT_END:])


def _check_seals(path: Path, seals: Seals, n_rows: int) -> None:
    """Raise ValueError if a byte of what was sealed is not as it was, saying where."""
    check_regular(path)
    begin, last = seals[0][0], seals[-1][0]
    width = (last - begin) / n_rows
    here, digest = 0, ""
    with path.open("rb") as file:
        for end, seal in seals:
            data = file.read(max(end - here, 0))
            if here == 0:
                total = _sum_of_header(data)
            else:
                total.update(data)
            digest = total.hexdigest()
            if len(data) != end - here or digest != seal:
                places = [round((place - begin) / width) for place in (here, end)]
                where = (
                    f"between points {places[0] + 1} and {places[1]}"
                    if here
                    else "in its head, or of another run"
                )
                raise ValueError(
                    f"it is damaged {where} (bytes {here} to {end} are not as they were written)"
                )
            here = end
