"""What a study measured, as one table, and the orders that are seen in it."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from railcosim.master.files import save
from railcosim.storage.whole import written_whole

from .study_point import Measurement, Point

DIMS = ("scheme", "owner", "contact", "step")
UNITS = {"step": "s"}
LONG_NAMES = {
    "error": "RMS error of what is compared over the RMS of its deviation from rest",
    "reference_error": "the same, of the reference; estimated by halving its intervals or steps",
    "growth": "factor by which the error grew a step, beyond what the motion did",
    "evaluations": "steps of each component in a communication step",
    "wall": "time for a simulated second, s",
    "steps": "communication steps made",
    "open_steps": "steps in which the scheme did not reach what it aims at",
    "fallbacks": "components that could not do what the scheme asks for",
    "stopped": "why the run ended early",
}
ASYMPTOTIC = 0.1
"""Relative error below which an error may be expected to follow its order."""
FINEST = 3
"""Steps, from the shortest, over which an order is observed."""
_NOTHING: dict[Any, tuple[Any, Any]] = {
    "float": (np.nan, np.float64), "int": (0, np.int64), "str": ("", object)
}  # fmt: skip
"""Value and type, by the type of a measurement's field, of what was not run."""


def table_of(rows: Sequence[tuple[Point, Measurement]], settings: Mapping[str, Any]) -> xr.Dataset:
    """Put all that was measured in a table, with dimensions scheme, owner, contact and step.

    Points that were not run have no error (NaN) and no steps (0).
    """
    coordinates: dict[str, list[Any]] = {
        "scheme": list(dict.fromkeys(p.name for p, _ in rows)),
        "owner": list(dict.fromkeys(str(p.owner) for p, _ in rows)),
        "contact": list(dict.fromkeys(p.contact.label for p, _ in rows)),
        "step": sorted({p.step for p, _ in rows}),
    }
    shape = [len(values) for values in coordinates.values()]
    columns = {field.name: np.full(shape, *_NOTHING[field.type]) for field in fields(Measurement)}
    orders = {p.name: p.scheme.order for p, _ in rows}
    for p, measurement in rows:
        place = (p.name, str(p.owner), p.contact.label, p.step)
        index = tuple(coordinates[d].index(v) for d, v in zip(DIMS, place, strict=True))
        for name, value in asdict(measurement).items():
            columns[name][index] = value
    dataset = xr.Dataset(
        {name: (DIMS, values, {"long_name": LONG_NAMES[name]}) for name, values in columns.items()},
        {
            **{d: (d, coordinates[d], {"units": UNITS.get(d, "")}) for d in DIMS},
            "order": ("scheme", [orders[name] for name in coordinates["scheme"]]),
        },
        dict(settings),
    )
    return dataset.assign(observed_order=observed_order(dataset))


def observed_order(table: xr.Dataset) -> xr.DataArray:
    """Slope of the error over the step, both logarithmic, by scheme, owner and contact.

    Over the `FINEST` shortest steps whose error is above the reference's and below `ASYMPTOTIC`;
    NaN where there are less than two.
    """
    error = table["error"].transpose(*DIMS).values
    # The reference is better than its estimate, which is what the last halving changed.
    floor = table["reference_error"].transpose(*DIMS).values
    usable = (error > floor) & (error < ASYMPTOTIC)
    x = np.log(table["step"].values)
    slopes = np.full(error.shape[:-1], np.nan)
    for place in np.ndindex(slopes.shape):
        use = np.flatnonzero(usable[place])[:FINEST]
        if len(use) > 1:
            slopes[place] = np.polyfit(x[use], np.log(error[place][use]), 1)[0]
    attrs = {"long_name": "slope of the error over the step, both logarithmic"}
    return xr.DataArray(slopes, dims=DIMS[:-1], attrs=attrs)


def save_table(table: xr.Dataset, folder: Path) -> list[Path]:
    """Write ``study.nc``, and ``study.csv`` with a line for every run."""
    netcdf, text = folder / "study.nc", folder / "study.csv"
    save(table, netcdf)
    names = [f.name for f in fields(Measurement)]
    with (
        written_whole(text) as partial,
        partial.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*DIMS, "order", *names])
        for place in itertools.product(*(table[d].values for d in DIMS)):
            row = table.sel(dict(zip(DIMS, place, strict=True)))
            if row["steps"] or row["stopped"].item():
                values = [row[name].item() for name in names]
                writer.writerow([*(str(v) for v in place), row["order"].item(), *values])
    return [netcdf, text]
