"""Responses to irregularity over the plane of its wavelength and the speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from railcosim.analysis.pair.contact import standing_in
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import Response
from railcosim.master.progress import Progress, unheard

from .frequency import response

System: TypeAlias = Callable[[FloatArray], Response]  # of omega (rad/s)

FIRST_POINTS, MOST_POINTS = 500, 20_000  # frequencies of the table that is interpolated
TOLERANCE = 2e-3  # of the local response: a fifth of a colour step on a map of three decades
BLOCK = 20_000  # points of the plane at once: 20 MB


@dataclass(frozen=True)
class Transfer:
    """Responses to unit irregularity under one wheelset at a time, at any frequency.

    Attributes
    ----------
    outputs : tuple of str
        What responds.
    spline : CubicSpline
        Of log(frequency in Hz), to (n_outputs, 4).
    points : int
        Frequencies at which the system was solved.
    """

    outputs: tuple[str, ...]
    spline: CubicSpline
    points: int

    def at(self, frequency: FloatArray) -> ComplexArray:
        """Responses at frequencies (n,) in Hz, shape (n, n_outputs, n_wheelsets)."""
        values: ComplexArray = self.spline(np.log(frequency))
        return values

    def only(self, output: str) -> Transfer:
        """The same for one output."""
        k = self.outputs.index(output)
        spline = CubicSpline.construct_fast(self.spline.c[:, :, k : k + 1], self.spline.x)
        return Transfer((output,), spline, self.points)


def transfer(system: System, outputs: Sequence[str], lowest: float, highest: float) -> Transfer:
    """Tabulate a system's response to irregularity, as finely as it needs.

    Intervals are halved until a cubic spline foresees every new point: 14 times around the narrow
    pinned-pinned resonance, once or twice elsewhere.

    Parameters
    ----------
    system : callable
        Angular frequencies to the coupled response, such as ``lambda w: coupled(models, w, k_H)``.
    outputs : sequence of str
        Names in that response.
    lowest, highest : float
        Frequencies in Hz.

    Raises
    ------
    ArithmeticError
        If the response is rougher than `MOST_POINTS` frequencies can show.
    """
    if not 0 < lowest < highest:
        raise ValueError(f"needs 0 < lowest < highest frequency, got {lowest}, {highest} Hz")
    at = np.linspace(np.log(lowest), np.log(highest), FIRST_POINTS)
    values = _gaps(system, outputs, at)
    unsure = np.ones(at.size - 1, dtype=bool)  # intervals
    while at.size < MOST_POINTS:
        spline = CubicSpline(at, values)
        middle = (at[1:] + at[:-1])[unsure] / 2
        new = _gaps(system, outputs, middle)
        size = np.abs(new).sum(axis=2)  # all wheelsets together: one alone may be as good as zero
        error = np.abs(spline(middle) - new).sum(axis=2) / np.where(size > 0, size, 1.0)
        wrong = middle[error.max(axis=1) > TOLERANCE]
        order = np.argsort(np.concatenate([at, middle]))
        at = np.concatenate([at, middle])[order]
        values = np.concatenate([values, new])[order]
        if wrong.size == 0:
            return Transfer(tuple(outputs), CubicSpline(at, values), at.size)
        # Both halves of an interval that was not foreseen, and their neighbours.
        unsure = np.zeros(at.size - 1, dtype=bool)
        found = np.searchsorted(at, wrong)
        unsure[np.clip(found[:, None] + np.arange(-2, 2), 0, at.size - 2)] = True
    raise ArithmeticError(
        f"the response cannot be interpolated between {lowest:g} and {highest:g} Hz"
    )


def _gaps(system: System, outputs: Sequence[str], log_frequency: FloatArray) -> ComplexArray:
    """Responses to unit irregularity under both wheels of each, (n, n_outputs, n_wheelsets)."""
    solved = system(2 * np.pi * np.exp(log_frequency))
    sides = ("left", "right")
    axles = standing_in(solved.inputs).axles
    both = np.tile(np.eye(len(axles)), (len(sides), 1))
    values = solved.to([f"{w}.{side}.irregularity_z" for side in sides for w in axles], both[None])
    wanted: ComplexArray = values[:, solved.rows(outputs)]
    return wanted


def plane(
    table: Transfer, positions: FloatArray, wavelength: FloatArray, speed: FloatArray
) -> ComplexArray:
    """Response to unit irregularity which every wheelset meets with its lag.

    Parameters
    ----------
    table : Transfer
        Between the lowest and the highest of ``speed / wavelength``.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    wavelength : array, shape (n_wavelength,)
        m.
    speed : array, shape (n_speed,)
        m/s.

    Returns
    -------
    array, shape (n_outputs, n_wavelength, n_speed)
        Per m of irregularity. A lag in time is one in place over the speed, so the phases depend on
        the wavelength alone (eq. 16 of Xu & Lu).
    """
    out = np.empty((len(table.outputs), wavelength.size, speed.size), dtype=complex)
    phase = np.exp(-2j * np.pi * (positions.max() - positions) / wavelength[:, None])
    rows = max(1, BLOCK // speed.size)
    for begin in range(0, wavelength.size, rows):
        part = slice(begin, begin + rows)
        frequency = speed / wavelength[part, None]
        single = table.at(frequency.ravel()).reshape(*frequency.shape, -1, 4)
        out[:, part] = np.einsum("lvoi,li->olv", single, phase[part], optimize=True)
    return out


@dataclass(frozen=True, kw_only=True)
class Tabulated:
    """Responses over the plane where they are those of one table at all speeds.

    Attributes
    ----------
    table : Transfer
        Between the lowest and the highest of ``speed / wavelength``.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    """

    table: Transfer
    positions: FloatArray

    @property
    def outputs(self) -> tuple[str, ...]:
        """What responds."""
        return self.table.outputs

    def over(self, wavelength: FloatArray, speed: FloatArray) -> ComplexArray:
        """See `plane`."""
        return plane(self.table, self.positions, wavelength, speed)


@dataclass(frozen=True, kw_only=True)
class BySpeed:
    """The same of a system that is another one at every speed, such as wheels that roll.

    Attributes
    ----------
    system : callable
        Angular frequencies and a speed in m/s to the coupled response.
    outputs : tuple of str
        Names in that response.
    excitation : str
        See `railcosim.analysis.response.frequency.response`.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    progress : callable
        Told how many speeds are done, and of how many.
    """

    system: Callable[[FloatArray, float], Response]
    outputs: tuple[str, ...]
    excitation: str
    positions: FloatArray
    progress: Progress = unheard

    def over(self, wavelength: FloatArray, speed: FloatArray) -> ComplexArray:
        """Per unit of the excitation, shape (n_outputs, n_wavelength, n_speed)."""
        out = np.empty((len(self.outputs), wavelength.size, speed.size), dtype=complex)
        for k, v in enumerate(speed.tolist()):
            self.progress(k, speed.size)
            system = self.system(2 * np.pi * v / wavelength, v)
            found = response(system, self.excitation, self.positions, v)
            out[:, :, k] = found[:, system.rows(self.outputs)].T
        return out


def plane_dataset(
    table: Transfer,
    positions: FloatArray,
    wavelength: FloatArray,
    speed: FloatArray,
    units: Sequence[str],
    **attributes: object,
) -> xr.Dataset:
    """Responses over the plane as a dataset; `units` of the outputs without the per m."""
    values = plane(table, positions, wavelength, speed)
    return over_plane(table.outputs, values, wavelength, speed, units, **attributes)


def over_plane(
    outputs: Sequence[str],
    values: ComplexArray,
    wavelength: FloatArray,
    speed: FloatArray,
    units: Sequence[str],
    **attributes: object,
) -> xr.Dataset:
    """The same of values, shape (n_outputs, n_wavelength, n_speed)."""
    coordinates = {
        "wavelength": ("wavelength", wavelength, {"units": "m", "long_name": "wavelength"}),
        "speed": ("speed", speed, {"units": "m/s", "long_name": "speed"}),
    }
    variables = {
        name.partition(".")[2]: (
            ("wavelength", "speed"),
            values[k],
            {"units": f"{unit}/m", "long_name": f"{name} per m of irregularity"},
        )
        for k, (name, unit) in enumerate(zip(outputs, units, strict=True))
    }
    return xr.Dataset(variables, coordinates, dict(attributes))
