"""Receptance of any FMU between two variables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.standing import standing
from railcosim.master.component import FloatArray
from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT, Pulses, Wanted, Way, best_way
from railcosim.master.linear.linear_form import error_estimate
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError

from .choices import Method
from .frf import check_finite

PULSES = Pulses(amplitude=1e4, step=1e-4, steps=13_500)


def receptance(
    fmu: str | Path,
    input: str,
    output: str,
    frequency: FloatArray,
    *,
    method: Method = Method.BEST,
    pulses: Pulses = PULSES,
    position: float | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Frequency response of any FMU between two variables, from a linear model of it.

    Parameters
    ----------
    fmu : str or Path
        For Model Exchange, or one that can save its state.
    input, output : str
        Variables.
    frequency : array, shape (n,)
        Hz.
    method : Method
        The best that the FMU allows if not given.
    pulses : Pulses
        For an FMU that is seen from outside.
    position : float, optional
        Where the last wheelset stands, m; of a vehicle or a track.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        ``receptance``, complex; the method and an estimate of the error in the attributes.

    Raises
    ------
    ArgumentError
        If pulses with that step do not show the frequencies, or no wheelset of the FMU can stand
        elsewhere.
    ArithmeticError
        If the response is not known, or no finite number.
    """
    fmu = Path(fmu)
    way = way_of(fmu, method, pulses)
    if way is pulses and frequency.max() > 0.5 / pulses.step:
        raise ArgumentError(
            "frequencies", f"up to {frequency.max():g} Hz",
            f"pulses with a step of {pulses.step:g} s show up to {0.5 / pulses.step:g} Hz; take a "
            "shorter --step",
        )  # fmt: skip
    wanted = Wanted(inputs=[input], outputs=[output], **standing(fmu, position))
    model = way(fmu, fmu.stem, wanted, progress)
    omega = 2 * np.pi * frequency
    values = model.frequency_response(omega)[:, 0, 0]
    error = float(error_estimate(model, omega).max())
    if error > 1.0:
        raise ArithmeticError(
            f"{way.description}: the response is known to {error:.1e} of itself only, so nothing "
            "is written; take another --method, --step, --steps or --amplitude"
        )
    unit = f"{model.outputs[0].unit or '1'}/{model.inputs[0].unit or '1'}"
    about: dict[str, object] = {
        "title": f"{fmu.name}, {input}, {output}",
        "fmu": fmu.name, "input": input, "output": output,
        "method": way.description, "error_estimate": error,
        **({} if position is None else {"position": position}),
    }  # fmt: skip
    return receptance_dataset(frequency, values, unit, about)


def way_of(fmu: Path, method: Method, pulses: Pulses = PULSES) -> Way:
    """The way in which an FMU is linearised by a method."""
    ways: dict[Method, Way] = {
        Method.EXACT: EXACT,
        Method.DIFFERENCES: DIFFERENCES,
        Method.PULSES: pulses,
    }
    return ways.get(method) or best_way(fmu, pulses)


def receptance_dataset(
    frequency: FloatArray, values: ComplexArray, unit: str, about: Mapping[str, object]
) -> xr.Dataset:
    """Over frequency (Hz); a number that is not finite is refused."""
    check_finite(frequency, values)
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    column = ("frequency", values, {"units": unit, "long_name": "receptance"})
    return xr.Dataset({"receptance": column}, {"frequency": axis}, about)
