"""From communication points to a dataset."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from railcosim.master.component import ComponentError, FloatArray, Type
from railcosim.master.cosimulation import CommunicationPoint, Divergence
from railcosim.master.suggest import suggest
from railcosim.master.system import System

_FIRST_ROWS = 1024
_BLOCK = 256  # points entered at once


class Recorder:
    """Keeps the outputs at communication points.

    Nothing recorded is lost if the run fails or is interrupted:

    >>> recorder = Recorder(system)                                     # doctest: +SKIP
    >>> try:                                                            # doctest: +SKIP
    ...     for point in cosimulate(system, scheme, 1e-4, 1.0):
    ...         recorder.add(point)
    ... finally:
    ...     save(recorder.to_dataset({"scheme": str(scheme)}), "run.nc")

    Parameters
    ----------
    system : System
        Where the points come from.
    every : int, optional
        Keep the first point and every so-manieth after it.
    variables : sequence of str, optional
        What to keep, as ``variable`` or ``component.variable``; everything if not given.

    Raises
    ------
    ValueError
        For `every` below 1, or an unknown or ambiguous variable.
    """

    def __init__(
        self, system: System, every: int = 1, variables: Sequence[str] | None = None
    ) -> None:
        if every < 1:
            raise ValueError(f"every must be at least 1, got {every}")
        self._every = every
        owners = [c.name for c in system.components for _ in c.outputs]
        labels = _labels(system)
        chosen = range(len(labels)) if variables is None else _choose(system, labels, variables)
        self._columns = np.array(chosen, dtype=np.intp)
        self._labels = [labels[i] for i in chosen]
        self._attrs = [_attrs(system, owners, i) for i in chosen]
        self._seen = 0
        self._latest: list[tuple[float, FloatArray]] = []  # kept, and not in the table yet
        self._rows = 0  # in the table
        self._table: FloatArray = np.empty((0, 1 + len(self._columns)))

    def __len__(self) -> int:
        return self._rows + len(self._latest)

    @property
    def seen(self) -> int:
        """How many points were offered, kept or not."""
        return self._seen

    def add(self, point: CommunicationPoint) -> None:
        """Keep one point, or skip it if it is not its turn."""
        self._seen += 1
        if (self._seen - 1) % self._every:
            return
        self._latest.append((point.time, point.outputs.copy()))  # those are the caller's to keep
        if len(self._latest) == _BLOCK:
            self._enter()

    def rows(self, first: int = 0) -> FloatArray:
        """Time and values kept, from the row `first` on, shape (n_rows, 1 + n_variables)."""
        self._enter()
        return self._table[first : self._rows].copy()

    def resume(self, seen: int, rows: FloatArray) -> None:
        """Go on as a recorder that has seen so many points and kept these `rows`."""
        self._seen, self._rows, self._latest = seen, len(rows), []
        self._table = rows.copy()

    def _enter(self) -> None:
        """Enter the latest points into the table: many at once cost less than each by itself."""
        if not self._latest:
            return
        end = self._rows + len(self._latest)
        if end > len(self._table):
            # Doubled when full, so that adding stays cheap however long the run gets.
            spare = np.empty((max(_FIRST_ROWS, end), self._table.shape[1]))
            self._table = np.concatenate([self._table[: self._rows], spare])
        block = self._table[self._rows : end]
        block[:, 0] = [time for time, _ in self._latest]
        values = np.concatenate([outputs for _, outputs in self._latest])
        block[:, 1:] = values.reshape(len(block), -1)[:, self._columns]
        self._rows, self._latest = end, []

    def to_dataset(self, attrs: Mapping[str, Any] | None = None) -> xr.Dataset:
        """Give what has been recorded so far.

        Parameters
        ----------
        attrs : mapping, optional
            All that is needed to run this again: parameters, FMU ids, scheme, step, versions.

        Returns
        -------
        xarray.Dataset
            Dimension ``time`` (s); one variable for each output, under its FMU name, with the
            component in front if two components have an output of that name.
        """
        self._enter()
        times, *values = self._table[: self._rows].T.copy()
        time = ("time", times, {"units": "s", "long_name": "time"})
        variables = {
            label: ("time", column.astype(dtype), variable_attrs)
            for label, column, (dtype, variable_attrs) in zip(
                self._labels, values, self._attrs, strict=True
            )
        }
        return xr.Dataset(variables, {"time": time}, dict(attrs or {}))


def record(
    points: Iterable[CommunicationPoint], recorder: Recorder
) -> Divergence | ComponentError | KeyboardInterrupt | None:
    """Record until the run ends, however it ends.

    Parameters
    ----------
    points : iterable of CommunicationPoint
        From `cosimulate`.
    recorder : Recorder
        Keeps them.

    Returns
    -------
    exception or None
        What stopped the run early; None if it came to its end. The recorder holds everything up
        to then: save it, and then raise or show this.
    """
    try:
        for point in points:
            recorder.add(point)
    except (Divergence, ComponentError, KeyboardInterrupt) as stopped:
        return stopped
    return None


def _labels(system: System) -> list[str]:
    """Names of all outputs in a dataset."""
    counts = Counter(variable.name for variable in system.variables)
    return [
        variable.name if counts[variable.name] == 1 else full
        for variable, full in zip(system.variables, system.names, strict=True)
    ]


def _choose(system: System, labels: list[str], variables: Sequence[str]) -> list[int]:
    """Find the outputs that the user names."""
    index = {name: i for names in (system.names, labels) for i, name in enumerate(names)}
    for name in variables:
        if name not in index:
            raise ValueError(f"no output {name!r} to record{suggest(name, index)}")
    return list(dict.fromkeys(index[name] for name in variables))


def _attrs(system: System, owners: Sequence[str], i: int) -> tuple[str, dict[str, Any]]:
    """Type and attributes of one variable."""
    variable = system.variables[i]
    attrs: dict[str, Any] = {
        "units": variable.unit,
        "long_name": variable.description or variable.name,
        "component": owners[i],
    }
    if variable.type is Type.REAL:
        return "f8", attrs
    if variable.items:  # as the conventions for climate and forecast say it
        names, numbers = zip(*variable.items, strict=True)
        attrs["flag_values"] = np.array(numbers, dtype="i4")
        attrs["flag_meanings"] = " ".join(name.replace(" ", "_") for name in names)
    return "i4", attrs
