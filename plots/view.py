"""A page that plays a run: vehicle and rail from the side, contact forces, time to be scrubbed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from railcosim.mechanics.ports import FORCE, IRREGULARITY, RAIL, SIDES, WHEEL, Layout, Port, Z
from railcosim.storage.whole import write_whole

from .chart import FloatArray
from .names import owner
from .sensors import sensor_groups

NUMBERS = 200_000
"""In a page: of more variables there are fewer frames."""
MOST, LEAST = 1500, 100  # frames
DIGITS = 5
JUMP = 1.0  # m: a position that jumps by more than it mostly moves has come round a ring
MOST_BODIES = 64
LONGEST = 300  # characters of an attribute


class NothingToViewError(ValueError):
    """There is no vehicle in a run, or nothing of it over time."""


def write_view(run: xr.Dataset, path: Path) -> int:
    """Write a self-contained page; nothing in it is fetched from elsewhere.

    Parameters
    ----------
    run : Dataset
        Of vehicle and track, over ``time``.
    path : Path
        The ``.html`` file.

    Returns
    -------
    int
        Frames it has.

    Raises
    ------
    NothingToViewError
        If the run has no wheelsets that move.
    """
    frames = frames_of(run)
    # Markup ends no script, whoever wrote the file.
    data = json.dumps(frames, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    about = {str(key): _short(value) for key, value in run.attrs.items() if key != "title"}
    environment = Environment(
        loader=PackageLoader("railcosim.plots", "."), autoescape=True, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    script, _, _ = environment.loader.get_source(environment, "view.js")  # type: ignore[union-attr]
    page = environment.get_template("view.html.j2").render(
        title=_short(run.attrs.get("title", "")) or "run", about=about, data=Markup(data),
        script=Markup(script), points=run.sizes["time"], frames=len(frames["time"]),
        sensors=bool(frames["sensors"]),
        step=float(np.ptp(np.asarray(run["time"]))) / max(1, len(frames["time"]) - 1),
    )  # fmt: skip
    write_whole(path, page)
    return len(frames["time"])


def frames_of(run: xr.Dataset) -> dict[str, Any]:
    """What the page draws: of wheels and bodies at so many times as a screen can show.

    Keys: ``time`` (s), ``wheels`` (by side and wheelset: m, N, kN's extremes), ``bodies``,
    ``sensors`` (what is seen where: m) and ``panels`` of what they tell (as axes have it).
    """
    known = {str(name) for name in run.data_vars if run[name].dims == ("time",)}
    layout = Layout.among(known)
    if layout is None or run.sizes.get("time", 0) < 2:
        raise NothingToViewError("has no wheelsets over time: it is no run of vehicle and track")
    places = [_place(run, name) for name in layout.of_axles("position") if name in known]
    if len(places) < layout.wheelsets:
        raise NothingToViewError("does not tell where its wheelsets are (wheelset[i].position)")
    bodies = _bodies(known)
    groups, sensors = list(sensor_groups(run[sorted(known)])), _sensors(run, known)
    count = 6 * layout.contacts + layout.wheelsets + 2 * len(bodies)
    count += 2 * sum(len(group.curves) for group in groups) + len(sensors)
    n = min(run.sizes["time"], max(LEAST, min(MOST, NUMBERS // count)))
    at = np.unique(np.linspace(0, run.sizes["time"] - 1, n).round().astype(int))

    def taken(name: str) -> list[float | None] | None:
        return _numbers(np.asarray(run[name])[at]) if name in known else None

    wheels = []
    for side in layout.sides:
        for i in layout.numbers:
            port = Port(i, side)
            force = port.name(FORCE)
            low_high = _extremes(np.asarray(run[force]), at) if force in known else None
            wheels.append({
                "side": side, "wheelset": i, "name": owner(port.wheel),
                "wheel": taken(port.name(WHEEL.motion)), "rail": taken(port.name(RAIL.motion)),
                "rough": taken(port.name(IRREGULARITY)), "force": taken(force),
                "extremes": low_high,
            })  # fmt: skip
    return {
        "time": _numbers(np.asarray(run["time"], dtype=float)[at], digits=9),
        "place": [_numbers(place[at], digits=9) for place in places],
        "sides": [side for side in SIDES if side in layout.sides],
        "wheels": wheels,
        "bodies": [
            {"name": owner(name), "kind": kind, "z": taken(f"{name}.{Z.name}"),
             "pitch": taken(f"{name}.pitch"), "on": on}
            for name, kind, on in _standing(bodies, layout.wheelsets)
        ],
        "sensors": [
            {"of": of, "side": seen, "at": x, "z": taken(f"{name}.{Z.name}")}
            for name, (of, seen, x) in sensors.items()
        ],
        "panels": [
            {"label": group.label, "curves": [
                {"name": words, "extremes": _extremes(group.factor * np.asarray(run[name]), at)}
                for name, words in group.curves.items()
            ]}
            for group in groups
        ],
    }  # fmt: skip


def _sensors(run: xr.Dataset, known: set[str]) -> dict[str, tuple[str, str, float]]:
    """By name: what a sensor of the track is on, on which side, and where, m."""
    found = {}
    for name in sorted(known):
        said = run[name].attrs
        x = said.get("at")
        if {"of", "side"} <= {*said} and isinstance(x, float | np.floating) and np.isfinite(x):
            found[name.rpartition(".")[0]] = _short(said["of"]), _short(said["side"]), float(x)
    return dict(sorted(found.items(), key=lambda one: one[1][2]))


def _place(run: xr.Dataset, name: str) -> FloatArray:
    """A position without its jumps where a ring begins anew, m."""
    x = np.asarray(run[name], dtype=float)
    moved = np.diff(x)
    usual = np.median(moved)
    moved[np.abs(moved - usual) > JUMP] = usual
    return np.concatenate([x[:1], x[0] + np.cumsum(moved)])


def _bodies(known: set[str]) -> list[tuple[str, str]]:
    """Car bodies and bogies whose height is known, from the front: name and kind."""
    owners = ["", *(f"vehicle[{i}]." for i in range(1, MOST_BODIES + 1))]
    numbers = ["", *(f"[{i}]" for i in range(1, MOST_BODIES + 1))]
    return [
        (f"{of}{kind}{number}", kind)
        for kind in ("carbody", "bogie")
        for of in owners
        for number in numbers
        if f"{of}{kind}{number}.{Z.name}" in known
    ]


def _standing(
    bodies: Sequence[tuple[str, str]], wheelsets: int
) -> list[tuple[str, str, list[int]]]:
    """Each with the wheelsets (from 0) it stands on: of each kind equal shares in their order.

    A run does not record it. Where there are no equal shares a kind is left out.
    """
    found = []
    for kind in ("carbody", "bogie"):
        alike = [name for name, its in bodies if its == kind]
        if not alike or wheelsets % len(alike):
            continue
        each = wheelsets // len(alike)
        found += [
            (name, kind, list(range(k * each, (k + 1) * each))) for k, name in enumerate(alike)
        ]
    return found


def _extremes(values: FloatArray, at: np.ndarray) -> list[list[float | None]]:
    """The least and the greatest from one frame to the next: a peak between them is seen."""
    starts = np.minimum(at, values.size - 1)
    return [
        _numbers(np.minimum.reduceat(values, starts)),
        _numbers(np.maximum.reduceat(values, starts)),
    ]


def _numbers(values: np.ndarray, digits: int = DIGITS) -> list[float | None]:
    """For a page: as many digits as are seen, nothing for what is no number."""
    return [float(f"{v:.{digits}g}") if np.isfinite(v) else None for v in values.tolist()]


def _short(value: object) -> str:
    text = str(np.asarray(value).tolist() if isinstance(value, np.ndarray) else value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
