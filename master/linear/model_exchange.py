"""Linear model of a Model Exchange FMU, from its derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from scipy.sparse import csc_array

from railcosim.master.component import FloatArray
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.flaws import FlawWarning
from railcosim.master.linear.operating_point import Element, OperatingPoint, Values
from railcosim.master.linear.state_space import IndexArray, StateSpace
from railcosim.master.linear.undeclared import told, undeclared
from railcosim.master.suggest import suggest

STEP = 1e-3
"""Step of the finite differences over the variable's magnitude. Extrapolated, their error is the
fourth power of it; rounding adds 1e-16 over it."""

Slope: TypeAlias = Callable[
    [OperatingPoint, Sequence[Element], IndexArray, FloatArray], tuple[FloatArray, FloatArray]
]
"""Change of the unknowns while the states and inputs at some positions change by so much; and the
same, known less exactly."""


def exact(
    point: OperatingPoint, unknowns: Sequence[Element], moved: IndexArray, amounts: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """By the FMU's directional derivatives."""
    change = point.derivative(unknowns, moved, amounts)
    return change, change


def adjoint(
    point: OperatingPoint, unknowns: Sequence[Element], moved: IndexArray, amounts: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """By the FMU's adjoint derivatives."""
    change = point.adjoint_jacobian(unknowns)[:, moved] @ amounts
    return change, change


def differences(
    point: OperatingPoint, unknowns: Sequence[Element], moved: IndexArray, amounts: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """By central differences of three steps, extrapolated from two and two."""
    central = []
    for factor in (1.0, 2.0, 4.0):
        step = np.zeros_like(point.values)
        step[moved] = factor * STEP * amounts
        ahead, behind = (point.evaluate(unknowns, point.values + s * step) for s in (1.0, -1.0))
        central.append((ahead - behind) / (2.0 * factor * STEP))
    first, second, third = central
    return (4.0 * first - second) / 3.0, (4.0 * second - third) / 3.0


def linear_model(
    path: str | Path,
    *,
    name: str | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    at: Values | None = None,
    parameters: Values | None = None,
    time: float = 0.0,
    slope: Slope | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> StateSpace:
    """Linear model of a Model Exchange FMU where its initialisation leaves it.

    Parameters
    ----------
    path : str or Path
        The ``.fmu`` file. Its code is run: load only what you would run.
    name : str, optional
        Name of the model; that in the FMU if not given.
    inputs, outputs : sequence of str, optional
        Continuous Real inputs and Real outputs to keep; all by default.
    at : mapping of str to float, optional
        Inputs that do not keep their start values.
    parameters : mapping of str to float, int or bool, optional
        Parameters that do not keep their defaults.
    time : float, optional
        In s.
    slope : callable, optional
        `exact`, `adjoint` or `differences`; by default the first that the FMU allows.
    progress : callable, optional
        Called now and then with the groups of columns done and their total.

    Returns
    -------
    StateSpace

    Raises
    ------
    FmuError
        If the file is not a usable Model Exchange FMU, or a name or value is wrong.
    ComponentError
        If the FMU refuses a call.

    Warns
    -----
    FlawWarning
        If it depends on more than its model description says.

    Notes
    -----
    Columns that have no row in common are found together [1]_: the declared dependencies of a
    track of 6000 modal states let two calls do for its state matrix. One more call, of all columns,
    tells whether something depends on more than is declared; that is found then, and told.

    References
    ----------
    .. [1] A. R. Curtis, M. J. D. Powell, J. K. Reid, On the estimation of sparse Jacobian
       matrices, IMA Journal of Applied Mathematics 13 (1974) 117-119.
       https://doi.org/10.1093/imamat/13.1.117
    """
    with OperatingPoint.load(Path(path), at=at or {}, parameters=parameters or {}, time=time) as p:
        columns = _select(p, "continuous input", p.inputs, inputs)
        rows = [p.outputs[k] for k in _select(p, "output", p.outputs, outputs)]
        n = len(p.states)
        wanted = np.r_[np.arange(n), n + np.array(columns, dtype=np.intp)]
        way = slope or best_slope(p.description)
        for one, kind, has in (
            (exact, "directional", p.description.has_directional_derivatives),
            (adjoint, "adjoint", p.description.has_adjoint_derivatives),
        ):
            if way is one and not has:
                raise FmuError(f"{path}: provides no {kind} derivatives; use finite differences")
        jacobians = _checked(p, (p.rates, rows), wanted, way, progress)
        best, rougher = (
            StateSpace(
                name=name or p.description.model_name,
                A=rates[:, :n],
                B=rates[:, n:].toarray(),
                C=observed[:, :n].toarray(),
                D=observed[:, n:].toarray(),
                inputs=tuple(p.inputs[k].variable for k in columns),
                outputs=tuple(row.variable for row in rows),
                standing=p.standing,
            )
            for rates, observed in zip(*jacobians, strict=True)
        )
        return replace(best, rougher=rougher) if way is differences else best


def best_slope(description: FmuDescription) -> Slope:
    """The most exact slope that an FMU offers."""
    if description.has_directional_derivatives:
        return exact
    return adjoint if description.has_adjoint_derivatives else differences


def _checked(
    point: OperatingPoint,
    unknowns: Sequence[Sequence[Element]],
    wanted: IndexArray,
    slope: Slope,
    progress: Callable[[int, int], None] | None,
) -> list[tuple[csc_array, csc_array]]:
    """Derivatives of each set of unknowns by the states and inputs `wanted`; each matrix twice.

    By what is declared, and by what else is found.
    """
    if not point.is_scalar:
        return [_by_column(point, rows, wanted, slope, progress) for rows in unknowns]
    patterns = [csc_array(point.dependencies(rows)[:, wanted]) for rows in unknowns]
    found = _jacobians(point, unknowns, patterns, wanted, slope, progress)
    names = [v.name for v in (*point.states, *point.inputs)]
    missing = list[tuple[str, str]]()
    for k, (rows, jacobian) in enumerate(zip(unknowns, found, strict=True)):
        pairs = undeclared(
            lambda columns, amounts, rows=rows: slope(point, rows, wanted[columns], amounts),  # type: ignore[misc]
            *jacobian, point.magnitudes[wanted],
        )  # fmt: skip
        missing += [(rows[i].name, names[wanted[j]]) for i, j in pairs]
        if pairs:
            i, j = np.array(pairs).T
            patterns[k] = csc_array(
                patterns[k] + csc_array((np.ones(i.size), (i, j)), patterns[k].shape)
            )
    if not missing:
        return found
    warnings.warn(
        told(point.description.path, list(dict.fromkeys(missing))), FlawWarning, stacklevel=3
    )
    return _jacobians(point, unknowns, patterns, wanted, slope, progress)


def _jacobians(
    point: OperatingPoint,
    unknowns: Sequence[Sequence[Element]],
    patterns: Sequence[csc_array],
    wanted: IndexArray,
    slope: Slope,
    progress: Callable[[int, int], None] | None,
) -> list[tuple[csc_array, csc_array]]:
    """The same, by these dependencies."""
    groups = [_groups(pattern) for pattern in patterns]
    done, total = 0, sum(len(columns) for columns in groups)
    found = []
    for rows, pattern, columns in zip(unknowns, patterns, groups, strict=True):
        values = np.zeros((2, pattern.nnz))
        for group in columns:
            change = np.stack(slope(point, rows, wanted[group], point.magnitudes[wanted[group]]))
            for k in group:
                part = slice(pattern.indptr[k], pattern.indptr[k + 1])
                size = point.magnitudes[wanted[k]]
                values[:, part] = change[:, pattern.indices[part]] / size
            done += 1
            if progress is not None and (done % 50 == 0 or done == total):
                progress(done, total)
        best, rougher = (
            csc_array((v, pattern.indices, pattern.indptr), pattern.shape) for v in values
        )
        found.append((best, rougher))
    return found


def _by_column(
    point: OperatingPoint,
    rows: Sequence[Element],
    wanted: IndexArray,
    slope: Slope,
    progress: Callable[[int, int], None] | None,
) -> tuple[csc_array, csc_array]:
    """As `_jacobians`, of arrays: what their elements depend on shows in what is not zero."""
    found: list[tuple[list[FloatArray], list[IndexArray]]] = [([], []), ([], [])]
    for done, k in enumerate(wanted.tolist(), start=1):
        one = np.array([k], dtype=np.intp)
        changes = slope(point, rows, one, point.magnitudes[one])
        for (values, places), change in zip(found, changes, strict=True):
            places.append(np.flatnonzero(change))
            values.append(change[places[-1]] / point.magnitudes[k])
        if progress is not None and (done % 50 == 0 or done == len(wanted)):
            progress(done, len(wanted))
    shape = (len(rows), len(wanted))
    best, rougher = (
        csc_array(
            (
                np.concatenate([np.empty(0), *values]),
                np.concatenate([np.empty(0, dtype=np.intp), *places]),
                np.cumsum([0, *(len(some) for some in places)]),
            ),
            shape,
        )
        for values, places in found
    )
    return best, rougher


def _groups(pattern: csc_array) -> list[list[int]]:
    """Columns that share no row, greedily."""
    # A row's colours in use, and a column's first free one, are bits of long integers.
    used = [0] * pattern.shape[0]
    groups: list[list[int]] = []
    for k in range(pattern.shape[1]):
        rows = pattern.indices[pattern.indptr[k] : pattern.indptr[k + 1]].tolist()
        if not rows:
            continue
        taken = 0
        for row in rows:
            taken |= used[row]
        free = ~taken & (taken + 1)
        for row in rows:
            used[row] |= free
        colour = free.bit_length() - 1
        if colour == len(groups):
            groups.append([])
        groups[colour].append(k)
    return groups


def _select(
    point: OperatingPoint, kind: str, variables: Sequence[Element], names: Sequence[str] | None
) -> list[int]:
    """Positions of the variables called `names`, or of all."""
    known = [v.name for v in variables]
    for name in names or ():
        if name not in known:
            raise FmuError(f"{point.description.path}: no {kind} {name}{suggest(name, known)}")
    return [known.index(name) for name in (known if names is None else names)]
