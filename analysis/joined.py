"""Datasets of single points put into one, over the axes of a sweep."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from railcosim.master.memory import afford
from railcosim.parameters import ArgumentError

Value: TypeAlias = float | str
Point: TypeAlias = tuple[Value, ...]
NUMBERS = "biuf"


class JoinError(ArithmeticError):
    """Points do not fit together."""


def joined(
    axes: Mapping[str, Sequence[Value]],
    found: Mapping[Point, xr.Dataset],
    only: Sequence[str],
    tell: Callable[[str], None],
) -> xr.Dataset:
    """Datasets of points as one; their variables and coordinates are all that any of them has.

    What an attribute says must be the same at all points. One that is a number, or several, and is
    not becomes a variable over the axes: of its own name, or of its variable's and its own; of
    several over ``name.index`` as well, NaN behind the last.

    Parameters
    ----------
    axes : mapping
        Values by name.
    found : mapping
        What there is, by its place on the axes.
    only : sequence of str
        Variables that are kept; all if empty.
    tell : callable
        Told what is left out.

    Raises
    ------
    ArgumentError
        If there is no variable that is to be kept.
    JoinError
        If a dimension without coordinates is not as long everywhere.
    """
    left_out: list[str] = []
    datasets = _with_attributes(list(found.values()), set(axes), left_out)
    aligned = _aligned(axes, list(found), [_chosen(one, datasets, only) for one in datasets])
    shape = tuple(len(values) for values in axes.values())
    at = {point: k for k, point in enumerate(itertools.product(*axes.values()))}
    taken = {name for one in aligned for name in one.variables}
    names = {name: f"{name} swept" if name in taken else name for name in axes}
    of = {name: [d[name] for d in aligned if name in d.data_vars] for name in _named(aligned)}
    afford(
        16 * len(at) * sum(having[0].size for having in of.values()),
        f"{len(at)} points of {aligned[0].nbytes / 1e6:.3g} MB",
        "keep fewer variables",
    )
    variables = {}
    for name, having in of.items():
        first = having[0]
        if any(one.dtype.kind not in f"{NUMBERS}c" for one in having):
            left_out.append(name)  # words are not of the kind that is swept
            continue
        if any(one.dims != first.dims for one in having):
            left_out.append(f"{name} where it is not over {', '.join(map(str, first.dims))}")
        kind = np.result_type(np.float64, *(one.dtype for one in having))
        whole = np.full((len(at), *first.shape), np.nan, dtype=kind)
        for point, dataset in zip(found, aligned, strict=True):
            if name in dataset.data_vars and dataset[name].dims == first.dims:
                whole[at[point]] = dataset[name].values
        dims = (*names.values(), *first.dims)
        variables[name] = (dims, whole.reshape(*shape, *first.shape), first.attrs)
    if left_out:
        tell(f"left out, as no numbers or not the same at all points: {', '.join(left_out)}")
    own = {str(name): one for dataset in reversed(aligned) for name, one in dataset.coords.items()}
    coords = {names[axis]: (names[axis], list(values)) for axis, values in axes.items()}
    return xr.Dataset(variables, {**own, **coords}, aligned[0].attrs)


def _named(datasets: Sequence[xr.Dataset]) -> list[str]:
    """Variables of any."""
    return list(dict.fromkeys(str(name) for one in datasets for name in one.data_vars))


def _with_attributes(
    datasets: list[xr.Dataset], axes: set[str], left_out: list[str]
) -> list[xr.Dataset]:
    """With variables for numbers that differ, as attributes or as coordinates without an index."""
    loose = {n for d in datasets for n in d.coords if n not in d.xindexes}
    differing = [n for n in loose if not _same([d.coords.get(n) for d in datasets])]
    whole = [d.reset_coords([n for n in differing if n in d.coords]) for d in datasets]
    names = _named(whole)
    more: list[dict[str, Any]] = [{} for _ in whole]
    _take([d.attrs for d in whole], "", more, {*names, *axes}, left_out)
    for name in names:
        having = [k for k, d in enumerate(whole) if name in d.data_vars]
        _take([whole[k][name].attrs for k in having], f"{name}.", [more[k] for k in having],
              {*names, *axes}, left_out)  # fmt: skip
    return [d.assign(new) for d, new in zip(whole, more, strict=True)]


def _take(
    attributes: list[dict[str, Any]],
    before: str,
    more: list[dict[str, Any]],
    taken: set[str],
    left_out: list[str],
) -> None:
    """Take attributes that differ away; what is a number goes to more."""
    for key in dict.fromkeys(key for one in attributes for key in one):
        values = [one.get(key) for one in attributes]
        if _same(values):
            continue
        name = f"{before}{key}"
        known = [np.asarray(value) for value in values if value is not None]
        number = all(one.ndim <= 1 and one.dtype.kind in NUMBERS for one in known)
        longest = max((one.size for one in known if one.ndim), default=None)
        for one, new in zip(attributes, more, strict=True):
            value = one.pop(key, None)
            if number and value is not None and name not in taken:
                new[name] = _variable(name, value, longest)
        if not number and name not in taken:
            left_out.append(name)


def _variable(name: str, value: Any, longest: int | None) -> xr.Variable:
    """A number, or where any point has several, as many as the point with most."""
    if longest is None:
        return xr.Variable((), float(value))
    row = np.full(longest, np.nan)
    numbers = np.atleast_1d(np.asarray(value, float))  # a file gives one of one as a number
    row[: numbers.size] = numbers
    return xr.Variable((f"{name}.index",), row)


def _same(values: Sequence[Any]) -> bool:
    if any(value is None for value in values):
        return False
    first = np.asarray(values[0])
    return all(
        np.array_equal(first, other, equal_nan=first.dtype.kind == other.dtype.kind == "f")
        for other in map(np.asarray, values[1:])
    )


def _chosen(one: xr.Dataset, datasets: list[xr.Dataset], only: Sequence[str]) -> xr.Dataset:
    """With the variables that are kept, and those that were their attributes."""
    known = _named(datasets)
    for name in only:
        if name not in known:
            raise ArgumentError("only", name, f"must be one of {', '.join(known)}")
    ends = tuple(f"{name}." for name in only)
    kept = [n for n in one.data_vars if n in only or (one[n].ndim == 0 and str(n).startswith(ends))]
    return one[kept] if only else one


def _aligned(
    axes: Mapping[str, Sequence[Value]], points: list[Point], datasets: list[xr.Dataset]
) -> list[xr.Dataset]:
    try:
        return list(xr.align(*datasets, join="outer"))
    except (ValueError, TypeError) as error:
        for dim in dict.fromkeys(dim for one in datasets for dim in one.dims):
            pairs = zip(points, datasets, strict=True)
            sizes = {one.sizes[dim]: point for point, one in pairs if dim in one.dims}
            if len(sizes) > 1 and any(
                dim in one.dims and dim not in one.xindexes for one in datasets
            ):
                where = ", ".join(f"{n} at {said(axes, point)}" for n, point in sizes.items())
                raise JoinError(f"points cannot be joined: dimension {dim} has no coordinates, and "
                                f"is of size {where}") from error  # fmt: skip
        raise JoinError(f"points cannot be joined: {' '.join(str(error).split())}") from error


def said(axes: Mapping[str, Sequence[Value]], point: Point) -> str:
    """Where a point is."""
    texts = (value if isinstance(value, str) else f"{value:g}" for value in point)
    return ", ".join(f"{name} = {text}" for name, text in zip(axes, texts, strict=True))
