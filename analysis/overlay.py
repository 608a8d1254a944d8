"""Variables of several results brought together: as they are, as spectra, as differences."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.parameters import ArgumentError

from .response.estimate import third_octaves as in_bands
from .response.estimate import welch_psd

MOST = 8
"""Curves of one variable with further dimensions, such as a sweep's: evenly chosen."""
SEGMENTS = 4  # of Welch's estimate, without their halves that overlap
EVEN = 1e-6  # of a step: how far samples may be from even ones
LISTED = 40  # names in a message
NOMINAL = 0.06  # tenths of a decade by which nominal centres may be off: 31.5 for 31.62 Hz


class InterpolatedWarning(UserWarning):
    """Results do not stand at the same places."""


@dataclass(frozen=True)
class Line:
    """One curve.

    Attributes
    ----------
    file, output : str
        Of which result, and which of its variables.
    part : str
        Which of several, where the variable has further dimensions.
    x, y : array, shape (n,)
        y real or complex.
    axis : str
        Name of the dimension.
    x_unit, unit : str
        Theirs.
    words : str
        What y has become, such as "density"; "" if it is as it was.
    told : str
        What the result says the variable is; "" if nothing.
    """

    file: str
    output: str
    part: str
    x: FloatArray
    y: np.ndarray
    axis: str
    x_unit: str
    unit: str
    words: str = ""
    told: str = ""


def lines_of(results: Mapping[str, xr.Dataset], outputs: Sequence[str]) -> list[Line]:
    """Curves of variables that all results have.

    Parameters
    ----------
    results : mapping of str to Dataset
        By what they are called.
    outputs : sequence of str
        Names of variables.

    Raises
    ------
    ArgumentError
        If a result has no such variable, or another unit or axis than the first.
    """
    lines = []
    for output in outputs:
        first: Line | None = None
        for file, dataset in results.items():
            for line in _lines(results, file, dataset, output):
                first = first or line
                for what in ("axis", "x_unit", "unit"):
                    theirs, ours = getattr(first, what), getattr(line, what)
                    if theirs != ours:
                        kind = {"axis": "over", "x_unit": "over an axis in", "unit": "in"}[what]
                        raise ArgumentError(
                            "output", output,
                            f"is {kind} {theirs or 'no unit'} in {first.file} and {kind} "
                            f"{ours or 'no unit'} in {file}: they do not go together",
                        )  # fmt: skip
                lines.append(line)
    return lines


def _lines(
    results: Mapping[str, xr.Dataset], file: str, dataset: xr.Dataset, output: str
) -> list[Line]:
    if output not in dataset.data_vars:
        common = set.intersection(*({str(n) for n in d.data_vars} for d in results.values()))
        names = [n for n in map(str, dataset.data_vars) if n in common]
        more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
        have = ", ".join(names[:LISTED]) + more if names else "none"
        whose = "all of them have" if len(results) > 1 else "it has"
        raise ArgumentError("output", output, f"is not in {file}; {whose} {have}")
    values = dataset[output]
    along = [str(d) for d in values.dims if values[d].dtype.kind in "if"]
    if not along or values.dtype.kind not in "ifc":
        raise ArgumentError("output", output, f"of {file} is over no axis of numbers")
    axis = along[-1]
    x = np.asarray(values[axis], dtype=float)
    if not values.size or not np.isfinite(x).all():
        raise ArgumentError(
            "output", output, f"of {file} is over {x.size} values of {axis}: must be finite ones"
        )
    rest = [d for d in values.dims if d != axis]
    order = np.argsort(x, kind="stable")  # a sweep may go down
    x, flat = x[order], np.asarray(values.transpose(*rest, axis)).reshape(-1, x.size)[:, order]
    of_rest = [np.asarray(values[d]) for d in rest]
    shown = sorted({round(k) for k in np.linspace(0, len(flat) - 1, min(MOST, len(flat)))})
    if len(shown) < len(flat):
        warnings.warn(
            f"{output} of {file}: {len(shown)} of {len(flat)} curves are drawn", stacklevel=4
        )
    lines = []
    for k in shown:
        at = np.unravel_index(k, [len(v) for v in of_rest]) if rest else ()
        part = ", ".join(
            f"{d} {v[i]:g}" if v.dtype.kind in "if" else f"{d} {v[i]}"
            for d, v, i in zip(rest, of_rest, at, strict=True)
        )
        x_unit, unit = (str(v.attrs.get("units", "")) for v in (values[axis], values))
        told = str(values.attrs.get("long_name", ""))
        lines.append(Line(file, output, part, x, flat[k], axis, x_unit, unit, told=told))
    return lines


def _density(line: Line) -> Line:
    """Welch's estimate of the power spectral density, of a record in time."""
    steps = np.diff(line.x)
    if line.axis != "time" or line.x.size < 2 * SEGMENTS or np.iscomplexobj(line.y):
        raise ArgumentError(
            "output", line.output, f"of {line.file} is over {line.axis}: no record in time"
        )
    _check_no_level(line)
    step = float(np.median(steps))
    x, y = line.x, line.y
    if not (step > 0 and np.isfinite(y).all()):
        raise ArgumentError(
            "output", line.output,
            f"of {line.file}: a spectrum needs finite numbers at times that go on",
        )  # fmt: skip
    if np.abs(steps - step).max() > EVEN * step:
        x = x[0] + step * np.arange(int((x[-1] - x[0]) / step * (1 + EVEN)) + 1)
        y = np.interp(x, line.x, line.y)
        warnings.warn(
            f"{line.output} of {line.file}: steps differ, so it is interpolated to {step:g} s",
            InterpolatedWarning, stacklevel=4,
        )  # fmt: skip
    segment = x.size * step / SEGMENTS
    f, psd, _ = welch_psd(y, step, segment)
    return replace(
        line, x=f[1:], y=psd[1:], axis="frequency", x_unit="Hz", unit=_squared(line.unit),
        words=f"density, Welch, {segment:.3g} s",
    )  # fmt: skip


def _squared(unit: str) -> str:
    """Of a density: unit squared per Hz."""
    if unit in ("", "1"):
        return "1/Hz"
    return f"{unit}²/Hz" if unit.isalpha() else f"({unit})²/Hz"


def _check_no_level(line: Line) -> None:
    """Raise ArgumentError for what is a level: of one there is a difference, and no more."""
    if line.unit.startswith("dB"):
        raise ArgumentError(
            "output", line.output,
            f"of {line.file} is in {line.unit}, so there is only a difference of it (--as "
            "difference), no ratio, no spectrum and no third octaves",
        )  # fmt: skip


def _is_density(line: Line) -> bool:
    return line.unit.endswith("/Hz")


def itself(lines: Sequence[Line]) -> list[Line]:
    """As they are; complex ones as magnitude and phase."""
    return list(lines)


def spectrum(lines: Sequence[Line]) -> list[Line]:
    """Power spectral densities of records in time, by Welch."""
    return [_density(line) for line in lines]


def third_octaves(lines: Sequence[Line]) -> list[Line]:
    """RMS in third octaves; of responses over frequency the quadratic mean of each."""
    return [_in_third_octaves(line) for line in lines]


def _in_third_octaves(line: Line) -> Line:
    _check_no_level(line)
    over = line if line.axis == "frequency" else _density(line)
    bands = 10 * np.log10(over.x[over.x > 0])
    if bands.size and np.abs(bands - np.round(bands)).max() < NOMINAL:
        raise ArgumentError("output", line.output, f"of {line.file} is in third octaves already")
    is_density = _is_density(over)
    power = over.y if is_density else np.abs(over.y) ** 2
    centres, inside = in_bands(over.x, power)
    if not centres.size:
        raise ArgumentError("output", line.output, f"of {line.file}: covers no third octave wholly")
    if is_density:
        words, unit = "RMS in third octaves", over.unit.removesuffix("/Hz")
        unit = unit[:-1].strip("()") if unit[-1] in "²2" else f"√({unit})"
    else:
        words, unit = "quadratic mean of third octaves", over.unit
        inside = inside / (centres * (10**0.05 - 10**-0.05))
    return replace(line, x=centres, y=np.sqrt(inside), axis="frequency", x_unit="Hz", unit=unit,
                   words=words)  # fmt: skip


def difference(lines: Sequence[Line]) -> list[Line]:
    """Of all but the first result, what they have more than it."""
    return [
        replace(other, x=x, y=y - y_first, words=f"{other.words} less {first.file}".strip())
        for first, other in _against_first(lines)
        for x, y_first, y in [_at_common(first, other)]
    ]


def ratio(lines: Sequence[Line]) -> list[Line]:
    """Likewise the level, dB: 20 lg of the ratio of sizes, 10 lg of that of densities."""
    found = []
    for first, other in _against_first(lines):
        _check_no_level(other)
        x, y_first, y = _at_common(first, other)
        with np.errstate(divide="ignore", invalid="ignore"):
            level = (10 if _is_density(other) else 20) * np.log10(np.abs(y) / np.abs(y_first))
        level[~np.isfinite(level)] = np.nan
        words = f"{other.words} over {first.file}".strip()
        found.append(replace(other, x=x, y=level, unit="dB", words=words))
    return found


def _against_first(lines: Sequence[Line]) -> list[tuple[Line, Line]]:
    """The first result's curve and another's, of one variable and part."""
    if len({line.file for line in lines}) < 2:
        raise ArgumentError("as", "difference or ratio", "needs two results")
    first = {
        (line.output, line.part): line for line in reversed(lines) if line.file == lines[0].file
    }
    pairs = []
    for line in lines:
        if line.file == lines[0].file:
            continue
        alike = first.get((line.output, line.part)) or first.get((line.output, ""))
        if alike is None:
            raise ArgumentError(
                "output", line.output,
                f"of {line.file} at {line.part} has nothing to be compared with in {lines[0].file}",
            )  # fmt: skip
        pairs.append((alike, line))
    return pairs


def _at_common(first: Line, other: Line) -> tuple[FloatArray, np.ndarray, np.ndarray]:
    """Places of the first within both, and both there."""
    if np.array_equal(first.x, other.x):
        return first.x, first.y, other.y
    low, high = max(first.x[0], other.x[0]), min(first.x[-1], other.x[-1])
    inside = (first.x >= low) & (first.x <= high)
    if not low < high or inside.sum() < 2:
        raise ArgumentError(
            "output", first.output,
            f"is over {first.x[0]:g} to {first.x[-1]:g} {first.x_unit} in {first.file} and "
            f"{other.x[0]:g} to {other.x[-1]:g} {other.x_unit} in {other.file}: they do not meet",
        )  # fmt: skip
    x = first.x[inside]
    if not np.isin(x, other.x).all():
        warnings.warn(
            f"{other.output} of {other.file} is interpolated to the places of {first.file}, "
            f"{x[0]:g} to {x[-1]:g} {first.x_unit}",
            InterpolatedWarning, stacklevel=4,
        )  # fmt: skip
    return x, first.y[inside], np.interp(x, other.x, other.y)


Way = Callable[[Sequence[Line]], list[Line]]
WAYS: dict[str, Way] = {
    "itself": itself,
    "spectrum": spectrum,
    "third-octaves": third_octaves,
    "difference": difference,
    "ratio": ratio,
}
"""What can be made of curves; several are made one after the other."""
