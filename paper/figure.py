"""One figure of the paper, reproduced: picture, data, and its numbers beside the paper's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
import xarray as xr

from railcosim.analysis.response.frequency import response
from railcosim.analysis.response.resonance import resonance
from railcosim.master.component import FloatArray
from railcosim.master.linear.receptance import Response
from railcosim.plots.chart import Chart

from .finding import Finding

FORCE = "wheelset[4].force_z"  # a unit force on wheelset 4
RAIL_FORCES = "wheelset[4].rail_force_z"  # one on each rail under it
IRREGULARITY = "wheelset[4].irregularity_z"  # unit irregularity under it alone
WHEEL = "vehicle.wheelset[4].left.wheel_z"
RAIL = "track.wheelset[4].left.rail_z"


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of the paper from our FMUs.

    Attributes
    ----------
    number : int
        In the paper.
    title, text : str
        What it shows; one or two sentences on what is seen.
    chart : Chart
        The picture.
    data : xarray.Dataset
        What is drawn, in SI units.
    findings : tuple of Finding
        Its numbers beside the paper's.
    """

    number: int
    title: str
    text: str
    chart: Chart
    data: xr.Dataset
    findings: tuple[Finding, ...]


def sizes(
    system: Response, excitation: str, positions: FloatArray, outputs: list[str]
) -> list[FloatArray]:
    """Magnitudes of outputs under an excitation of `analysis.frequency.response`."""
    values = response(system, excitation, positions, speed=1.0)
    return [np.abs(values[:, row]) for row in system.rows(outputs)]


def peak(frequency: FloatArray, size: FloatArray, low: float, high: float) -> float:
    """Highest resonance between two frequencies, Hz; NaN if the response has no top there."""
    inside = (frequency >= low) & (frequency <= high)
    f, s = frequency[inside], size[inside]
    tops, _ = scipy.signal.find_peaks(s)
    if tops.size == 0:
        return float("nan")
    top = tops[np.argmax(s[tops])]
    return resonance(f[top - 1 : top + 2], s[top - 1 : top + 2])


def dip(frequency: FloatArray, size: FloatArray, low: float, high: float) -> float:
    """Antiresonance between two frequencies, Hz."""
    inside = (frequency >= low) & (frequency <= high)
    return resonance(frequency[inside], size[inside], dip=True)


def curves_dataset(
    frequency: FloatArray, curves: dict[str, tuple[FloatArray, str]], **attributes: object
) -> xr.Dataset:
    """Magnitudes over frequency by name, each with its unit."""
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    variables = {
        name: ("frequency", values, {"units": unit, "long_name": name.replace("_", " ")})
        for name, (values, unit) in curves.items()
    }
    return xr.Dataset(variables, {"frequency": axis}, dict(attributes))
