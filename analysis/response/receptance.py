"""Receptances: of any FMU between two variables, and of the rail from the finite elements."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.standing import FARTHEST, standing
from railcosim.master.component import FloatArray
from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT, Pulses, Wanted, Way, best_way
from railcosim.master.linear.linear_form import error_estimate
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.ports import Direction
from railcosim.parameters import ArgumentError
from railcosim.track.cell import railseats
from railcosim.track.files import read_track
from railcosim.track.layers import MASS
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, direct_receptance, infinite_receptance
from railcosim.track.section import SPATIAL
from railcosim.track.transition import Line, line_receptance

from .choices import Method
from .frf import check_finite

WIDEST_GAP = 0.1  # m
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
    return _dataset(frequency, values, unit, about)


def way_of(fmu: Path, method: Method, pulses: Pulses = PULSES) -> Way:
    """The way in which an FMU is linearised by a method."""
    ways: dict[Method, Way] = {
        Method.EXACT: EXACT,
        Method.DIFFERENCES: DIFFERENCES,
        Method.PULSES: pulses,
    }
    return ways.get(method) or best_way(fmu, pulses)


def track_receptance(
    track: Track,
    frequency: FloatArray,
    *,
    direction: str = "z",
    response: str = "z",
    position: str | float = "railseat",
    offset: float = 0.0,
    both_rails: bool = True,
    ring: bool = False,
    changes: Sequence[LocalChange] = (),
    progress: Progress = unheard,
) -> xr.Dataset:
    """Receptance of the left rail at the place of the load, from the finite elements.

    Parameters
    ----------
    track : Track
        Parameters.
    frequency : array, shape (n,)
        Hz.
    direction, response : str
        Of the load and of the motion, at the head: ``z`` (down), ``y`` (to the right), ``roll``
        (about the forward axis: the right side down). z for z is the vertical model's, all others
        are of the spatial one.
    position : str or float
        ``railseat``, ``midspan``, or m along the track from where a cell begins.
    offset : float
        Of load and response from the middle of the head towards the track's centre, m.
    both_rails : bool
        The same unit load on each rail, or on the left one.
    ring : bool
        Of the ring of cells that the FMUs have, or of a track without end.
    changes : sequence of LocalChange
        What is different at single places.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        ``receptance``, complex. The attributes ``ring_error`` and ``ring_error_at`` say by how much
        the ring differs from the track without end, at most, and at what frequency (Hz).

    Raises
    ------
    ArgumentError
        If there is no such direction or place.
    """
    x = place_of(track, position)
    loaded, seen = direction_of("direction", direction), direction_of("response", response)
    side, right = (BOTH, -offset) if both_rails else (-1, offset)
    loads = [Point(x=x, side=side, direction=loaded, offset=right)]
    here = Point(x=x, direction=seen, offset=offset)
    solved = []
    for k, receptance_of in enumerate((infinite_receptance, direct_receptance)):

        def half(done: float, total: float, k: int = k) -> None:
            progress(k + done / total, 2)

        found = receptance_of(track, 2 * np.pi * frequency, loads, [here], half, changes=changes)
        solved.append(found[:, 0, 0])
    endless, round_ = solved
    off = np.abs(round_ - endless)
    error = np.divide(off, np.abs(endless), out=np.zeros_like(off), where=off > 0)
    worst = int(np.argmax(error))
    about = {
        "motion": f"{seen.name} for {loaded.name}",
        "at": f"{x:g} m along the track, from where a cell begins ({position})",
        "load": "both" if both_rails else "single",
        "track": f"{ring_of(track)}" if ring else "endless",
        **({"changed": ", ".join(map(str, changes))} if changes else {}),
    }
    unit = f"{seen.motion}/{f'({loaded.force})' if '.' in loaded.force else loaded.force}"
    worst_of_ring = {"ring_error": float(error[worst]), "ring_error_at": float(frequency[worst])}
    where = f"{position} ({x:g} m)" if str(position).isalpha() else f"{x:g} m"
    title = [
        f"rail {seen.positive.partition(',')[0]}",
        f"load {loaded.positive.partition(',')[0]} at {where}",
        "both rails" if both_rails else "one rail",
        about["track"],
        *([about["changed"]] if changes else []),
    ]
    about = {"title": ", ".join(title), **about}
    asked = {
        "direction": loaded.name, "response": seen.name, "offset": offset, "position": position,
    }  # fmt: skip
    values = round_ if ring else endless
    return _dataset(frequency, values, unit, {**about, **asked, **worst_of_ring})


def transition_receptance(
    line: Line,
    frequency: FloatArray,
    *,
    position: float | Sequence[float],
    both_rails: bool = True,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Receptance of the left rail where it is loaded, on tracks of several kinds that are joined.

    Parameters
    ----------
    line : Line
        The tracks.
    frequency : array, shape (n,)
        Hz; 0 is the static flexibility.
    position : float or sequence of float
        m along the line.
    both_rails : bool
        The same unit load on each rail, or on the left one.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        ``receptance``, complex, over frequency; over position and frequency of several positions.
    """
    along = np.atleast_1d(np.asarray(position, dtype=float))
    if not (np.abs(along) <= FARTHEST).all():
        raise ArgumentError("position", position, f"must be from -{FARTHEST:g} to {FARTHEST:g} m")
    found = np.empty((along.size, frequency.size), complex)
    for k, x in enumerate(along):

        def part(done: float, total: float, k: int = k) -> None:
            progress(k + done / total, along.size)

        load = Point(x=float(x), side=BOTH if both_rails else -1)
        here = [Point(x=float(x))]
        found[k] = line_receptance(line, 2 * np.pi * frequency, [load], here, part)[:, 0, 0]
    first, *others = line.names
    told = ", ".join(f"{name} from {x:g} m" for name, x in zip(others, line.joints, strict=True))
    about = {"load": "both" if both_rails else "single", "track": f"{first}, then {told}"}
    if np.ndim(position):
        check_finite(frequency, found)
        return xr.Dataset(
            {"receptance": (("position", "frequency"), found,
                            {"units": "m/N", "long_name": "receptance"})},
            {"position": ("position", along, {"units": "m", "long_name": "along the track"}),
             "frequency": ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})},
            about,
        )  # fmt: skip
    where = f"{along[0]:g} m along the track"
    rails = "both rails" if both_rails else "one rail"
    title = f"rail down, load down at {where}, {rails}, {about['track']}"
    about |= {"title": title, "at": where}
    return _dataset(frequency, found[0], "m/N", {**about, "position": float(along[0])})


def line_of(track: Track, name: str, then: Sequence[str]) -> Line:
    """A track of some name, and others behind each other as ``TRACK@PLACE``: a file or name, m.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    tracks, names = [track], [name]
    joints: list[float] = []
    for text in then:
        source, _, place = text.rpartition("@")
        try:
            joint = float(place)
        except ValueError:
            joint = np.nan
        if not source or not abs(joint) <= FARTHEST or (joints and joint <= joints[-1]):
            raise ArgumentError(
                "then", text,
                f"must be TRACK@PLACE, such as ballasted@0, from -{FARTHEST:g} to {FARTHEST:g} m "
                "along the track and farther than the one before",
            )  # fmt: skip
        tracks.append(read_track(source))
        names.append(source)
        joints.append(joint)
    return Line(tracks=tuple(tracks), joints=tuple(joints), names=tuple(names))


def change_of(track: Track, text: str) -> LocalChange:
    """Read ``WHAT[.left|.right]@PLACE=VALUE`` or ``=gap:METRES``; see `LocalChange`.

    A place is in m along the track, as the load's position is, or ``railseat`` or ``midspan``, with
    ``+2`` or ``-1`` so many bays further.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    found = re.fullmatch(
        r"(?P<what>\w+)(\.(?P<side>left|right))?@(?P<name>railseat|midspan)?(?P<x>[^=]*)"
        r"=(?P<gap>gap:)?(?P<value>[^=]+)", text
    )  # fmt: skip
    try:
        if found is None:
            raise ValueError
        value = float(found["value"])
        if found["name"]:
            bays = int(found["x"] or 0)
            x = place_of(track, found["name"]) + bays * track.fastening.spacing
        else:
            x = float(found["x"])
    except ValueError as error:
        raise ArgumentError(
            "local", text,
            "must be WHAT@PLACE=VALUE, such as fastening.left@railseat+1=0, mass@1.2=15 or "
            "sleeper@railseat=gap:1e-3",
        ) from error  # fmt: skip
    if not (abs(x) <= FARTHEST and np.isfinite(value)):
        raise ArgumentError("local", text, f"must be finite, and at most {FARTHEST:g} m away")
    sides = {"left": (-1,), "right": (1,)}.get(found["side"], (-1, 1))
    if not found["gap"]:
        return LocalChange(what=found["what"], x=x, value=value, sides=sides)
    if not 0 <= value <= WIDEST_GAP or found["what"] == MASS:
        raise ArgumentError(
            "local", text, f"must be a gap of 0 to {WIDEST_GAP:g} m, of a fastening or a layer"
        )
    return LocalChange(what=found["what"], x=x, value=1.0, sides=sides, gap=value)


def direction_of(option: str, name: str) -> Direction:
    """A direction by its name; ArgumentError if the track does not move in such a one."""
    known = {direction.name: direction for direction in SPATIAL}
    if name not in known:
        raise ArgumentError(option, name, f"must be one of {', '.join(known)}")
    return known[name]


def ring_of(track: Track) -> str:
    """The ring of the FMUs, in words."""
    return f"ring of {track.mesh.cells} cells, {track.length:g} m"


def place_of(track: Track, position: str | float) -> float:
    """A position as m along the track, from where a cell begins; ArgumentError if it is none."""
    seat = float(railseats(track)[track.bays // 2])
    named = {"railseat": seat, "midspan": seat + track.fastening.spacing / 2}
    if position in named:
        return named[str(position)]
    try:
        x = float(position)
    except ValueError:
        x = np.nan
    if not abs(x) <= FARTHEST:
        raise ArgumentError(
            "position", position,
            f"must be railseat, midspan, or from -{FARTHEST:g} to {FARTHEST:g} m",
        )  # fmt: skip
    return x


def _dataset(
    frequency: FloatArray, values: ComplexArray, unit: str, about: Mapping[str, object]
) -> xr.Dataset:
    check_finite(frequency, values)
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    column = ("frequency", values, {"units": unit, "long_name": "receptance"})
    return xr.Dataset({"receptance": column}, {"frequency": axis}, about)
