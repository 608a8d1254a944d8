"""Running safety of a run in time: Y/Q, sum of guiding forces, wheel unloading, per EN 14363.

Forces are those that wheels do to rails; Y of a wheel is positive outward, where its flange
presses.

Filters, the sliding mean and the percentiles are those of the standard's table of assessment
quantities [1]_. Assumed, as the table does not say it: a Butterworth filter, which passes once and
begins as if the first value had always been; Y/Q is the quotient of the filtered forces, of which
the mean is taken; sections lie one behind the other, and the worst counts. The standard's estimate
of a maximum from many sections by regression is not made.

References
----------
.. [1] Acceptance test according to UIC 518 and EN 14363, gensys.se/course/UIC518_tests.html: (Sum
   Y)2m and (Y/Q)2m from 20 Hz, mean over 2 m every 0.5 m, percentiles 0.15 and 99.85; Q from 20 Hz.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from scipy import signal

from railcosim.master.component import FloatArray
from railcosim.mechanics.ports import FORCE, MOST_WHEELSETS, Layout, Port, Y, Z
from railcosim.parameters import ArgumentError, ParameterError

CUT_OFF = 20.0  # Hz
ORDER = 4  # 24 dB an octave
WINDOW, EVERY = 2.0, 0.5  # m
PERCENTILES = (0.15, 99.85)
SECTION = 250.0  # m: what is usual below 220 km/h
LONGEST_STEP = 1 / (10 * CUT_OFF)  # s
EVEN = 1e-6  # of a step: as even as sums of steps are
MOST = 5_000_000  # rows
QUOTIENT_LIMIT = 0.8
"""Of (Y/Q)2m: UIC 518 and 716, as the pages on both at railwaynews.net have it; the leaflets and
the standard were not at hand."""
OUTWARD = {"left": -1.0, "right": 1.0}
"""Sign of Y by the side, of a force to the right on the rail."""


def guiding_force_limit(static_load: float) -> float:
    """Prud'homme's limit of the sum of guiding forces of a wheelset, N, from its weight, N.

    k (10 + 2 Q0 / 3) kN by the wheel's load Q0, of UIC 716, with k = 1; from the same secondary
    source.
    """
    return 10e3 + static_load / 3


def low_pass(values: FloatArray, step: float) -> FloatArray:
    """What of a signal is below 20 Hz: Butterworth, fourth order.

    Parameters
    ----------
    values : array, shape (n, ...)
        At even times.
    step : float
        s, at most 5 ms: ten samples of 20 Hz.

    Raises
    ------
    ArgumentError
        If the steps are too long.
    """
    if not 0 < step <= LONGEST_STEP:
        raise ArgumentError(
            "step", step, f"must be above 0 and at most {LONGEST_STEP:g} s, as {CUT_OFF:g} Hz count"
        )
    sections = signal.butter(ORDER, CUT_OFF, fs=1 / step, output="sos")
    ones = signal.sosfilt_zi(sections).reshape(len(sections), 2, *(1 for _ in values.shape[1:]))
    passed: FloatArray = signal.sosfilt(sections, values, axis=0, zi=ones * values[:1])[0]
    return passed


def sliding_mean(
    values: FloatArray, distance: FloatArray, window: float = WINDOW, every: float = EVERY
) -> tuple[FloatArray, FloatArray]:
    """Means over a window along the track, of what is a line between samples.

    Parameters
    ----------
    values : array, shape (n, ...)
        At `distance`.
    distance : array, shape (n,)
        Increasing, m.
    window, every : float
        Its length, and from one mean to the next, m.

    Returns
    -------
    places : array, shape (m,)
        Middles of windows, m.
    means : array, shape (m, ...)

    Raises
    ------
    ParameterError
        If there is not one window.
    """
    there = float(distance[-1] - distance[0])
    if there < window:
        raise ParameterError(
            f"the run goes over {there:.3g} m, and means are over {window:g} m: make it longer"
        )
    begin = distance[0] + every * np.arange(math.floor((there - window) / every + EVEN) + 1)
    below, above = (_integral(values, distance, ends) for ends in (begin, begin + window))
    return begin + window / 2, (above - below) / window


def _integral(values: FloatArray, distance: FloatArray, to: FloatArray) -> FloatArray:
    """From the first sample to places."""
    wide = distance.reshape(-1, *(1 for _ in values.shape[1:]))
    pieces = np.diff(wide, axis=0) * (values[1:] + values[:-1]) / 2
    until = np.concatenate([np.zeros_like(values[:1]), np.cumsum(pieces, axis=0)])
    k = np.clip(np.searchsorted(distance, to, side="right") - 1, 0, distance.size - 2)
    into = to.reshape(-1, *(1 for _ in values.shape[1:])) - wide[k]
    slope = (values[k + 1] - values[k]) / (wide[k + 1] - wide[k])
    found: FloatArray = until[k] + into * (values[k] + slope * into / 2)
    return found


def percentiles(values: FloatArray, distance: FloatArray, section: float = SECTION) -> FloatArray:
    """0.15 and 99.85 per cent of the values in each section.

    Parameters
    ----------
    values : array, shape (n, ...)
        At `distance`.
    distance : array, shape (n,)
        Increasing, m.
    section : float
        m: sections are alike, and at least so long; a shorter run is one section.

    Returns
    -------
    array, shape (sections, 2, ...)
    """
    if not section > 0:
        raise ArgumentError("section", section, "must be above 0 m")
    there = float(distance[-1] - distance[0])
    count = max(1, math.floor(there / section))
    ends = np.searchsorted(distance, distance[0] + there / count * np.arange(1, count))
    parts = np.split(values, ends)
    return np.stack([np.percentile(part, PERCENTILES, axis=0) for part in parts])


def running_safety(
    run: xr.Dataset, *, speed: float | None = None, section: float = SECTION
) -> xr.Dataset:
    """Running safety of a run that was recorded.

    Parameters
    ----------
    run : Dataset
        Over ``time``, s, with ``wheelset[i].side.force_z`` and, of a run in space, ``force_y``, N.
        It starts at rest: the first forces are the static loads Q0.
    speed : float, optional
        m/s; the attribute ``speed`` of the run if not given.
    section : float
        See `percentiles`.

    Returns
    -------
    Dataset
        Over ``distance``, m, gone by the vehicle: ``wheelset[i].side.derailment_quotient``,
        (Y/Q)2m, outward positive; ``wheelset[i].guiding_force_sum``, (Sum Y)2m, N, to the right
        positive; ``wheelset[i].side.unloading``, (Q0 - Q) / Q0. Without ``force_y`` only the last.
        Attributes of each: ``lowest`` and ``highest``, the percentiles in the section where they
        are so, and ``limit`` of the standard. Y/Q is nan where a wheel is off its rail.

    Raises
    ------
    ParameterError
        If there are no such forces, wheels carry nothing at first, no speed is known, or the run is
        too short or its steps too long.
    """
    speed = run.attrs.get("speed") if speed is None else float(speed)
    if speed is None or not 0 < speed < math.inf:
        raise ArgumentError("speed", speed, "must be known and above 0 m/s")
    layout = _layout(run)
    step, time, aside, down = _even(run, layout)
    distance = speed * (time - time[0])
    static = down[0]
    if not (np.isfinite(down).all() and (static > 0).all()):
        raise ParameterError("the run starts with wheels that carry nothing: no static load")
    Q = low_pass(down, step)
    places, _ = sliding_mean(Q, distance)
    found = xr.Dataset(
        coords={"distance": ("distance", places, {"units": "m", "long_name": "gone"})}
    )
    if aside is not None:
        Y_force = low_pass(aside, step)
        for name, mean, about in (
            *_quotients(layout, Y_force, Q, distance),
            *_sums(layout, Y_force, static, distance),
        ):
            found[name] = ("distance", mean, {**about, **_lasting(mean, places, section)})
    for port, gone in zip(layout.ports, ((static - Q) / static).T, strict=True):
        about = {"units": "1", "long_name": "(Q0 - Q) / Q0 below 20 Hz"}
        lasting = _lasting(gone, distance, section)
        at_places = np.interp(places, distance, gone)
        found[f"{port.wheel}.unloading"] = ("distance", at_places, {**about, **lasting})
    count = max(1, math.floor(float(distance[-1]) / section))
    found.attrs = {
        "speed": speed, "sections": count, "section": float(distance[-1]) / count,
        "standard": "EN 14363: filters, means and percentiles; no regression over sections",
    }  # fmt: skip
    return found


Told = Iterator[tuple[str, FloatArray, dict[str, object]]]
"""Name, means and attributes of what is a mean over 2 m."""


def _quotients(layout: Layout, Y_force: FloatArray, Q: FloatArray, distance: FloatArray) -> Told:
    """(Y/Q)2m of the wheels."""
    outward = np.array([OUTWARD[port.side] for port in layout.ports])
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = np.where(Q > 0, outward * Y_force / Q, np.nan)
    means = sliding_mean(quotient, distance)[1]
    about = {"units": "1", "long_name": "(Y/Q)2m, outward", "limit": QUOTIENT_LIMIT}
    for port, mean in zip(layout.ports, means.T, strict=True):
        yield f"{port.wheel}.derailment_quotient", mean, about


def _sums(layout: Layout, Y_force: FloatArray, static: FloatArray, distance: FloatArray) -> Told:
    """(Sum Y)2m of the wheelsets."""
    by_axle = (-1, len(layout.sides), layout.wheelsets)
    means = sliding_mean(Y_force.reshape(by_axle).sum(axis=1), distance)[1]
    weights = static.reshape(by_axle).sum(axis=1)[0]
    for axle, mean, weight in zip(layout.axles, means.T, weights, strict=True):
        limit = guiding_force_limit(float(weight))
        about = {"units": "N", "long_name": "(Sum Y)2m, to the right", "limit": limit}
        yield f"{axle}.guiding_force_sum", mean, about


def _lasting(values: FloatArray, at: FloatArray, section: float) -> dict[str, float]:
    """Percentiles of the sections where they are worst."""
    low, high = percentiles(values, at, section).T
    return {"lowest": float(low.min()), "highest": float(high.max())}


def _layout(run: xr.Dataset) -> Layout:
    """Of all wheels whose vertical forces are there; one port a wheel."""
    names = set(map(str, run.data_vars))
    count = 0
    while count < MOST_WHEELSETS and Port(count + 1, "left", Z).name(FORCE) in names:
        count += 1
    layout = Layout(max(count, 1))
    missing = [name for name in layout.names(FORCE) if name not in names]
    if missing or "time" not in run.dims:
        raise ParameterError(f"the run has no {missing[0] if missing else 'time'}")
    return layout


def _even(
    run: xr.Dataset, layout: Layout
) -> tuple[float, FloatArray, FloatArray | None, FloatArray]:
    """Step, times, Y to the right (None: a vertical run) and Q, each (n, wheels), at even times."""
    time = np.asarray(run["time"], dtype=float)
    steps = np.diff(time)
    if time.size < 2 or not (steps > 0).all():
        raise ParameterError("the run's times do not increase")
    step = float(steps.min())
    even = float(np.ptp(steps)) <= EVEN * step
    at = time if even else np.arange(time[0], time[-1] + step / 2, step)
    if at.size > MOST:
        raise ParameterError(
            f"the run has steps down to {step:g} s: {at.size} rows; at most {MOST}"
        )

    def forces(names: list[str]) -> FloatArray:
        columns = [np.asarray(run[name], dtype=float) for name in names]
        return np.stack([c if even else np.interp(at, time, c) for c in columns], axis=1)

    across = [Port(p.wheelset, p.side, Y).name(FORCE) for p in layout.ports]
    known = [name for name in across if name in run.data_vars]
    if known and len(known) < len(across):
        raise ParameterError(f"the run has {known[0]}, but not all of its kind")
    span = float(at[-1] - at[0]) / (at.size - 1)
    return span, at, forces(known) if known else None, forces(list(layout.names(FORCE)))
