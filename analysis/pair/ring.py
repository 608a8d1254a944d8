"""Whether a vehicle fits on the ring of a track, where both are FMUs."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.archive import FmuError, read_annotations
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout
from railcosim.track.decay import NEAREST, PROMISED, PROMISED_TO, RingWarning

TOOL, RING = "railcosim", "Ring"
POSITIONS = set(Layout(MOST_WHEELSETS).of_axles("position"))
CURE = "export the track with more [mesh] cells"


def check_ring_of(track: Path, positions: FloatArray) -> None:
    """Check wheelsets against what a track FMU of ours says of its ring; others say nothing.

    Parameters
    ----------
    track : Path
        FMU file.
    positions : array, shape (4,)
        Of the wheelsets, m.

    Raises
    ------
    FmuError
        If what the FMU says is no number.
    CouplingError
        If the first wheelset meets the last one through the ring; see `check_line_of`, too.

    Warns
    -----
    RingWarning
        If they are farther apart than the track is made for.
    """
    noted = read_annotations(track, TOOL).get(RING)
    if noted is None:
        return
    check_line_of(track, positions)
    length, longest = (_number(track, noted, name) for name in ("length", "longestVehicle"))
    span = float(np.ptp(positions))
    if length - span < NEAREST:
        raise CouplingError(
            f"{track}: is a ring of {length:g} m; the vehicle is {span:g} m long from its first "
            f"wheelset to its last, and less than {NEAREST:g} m are left the other way round: "
            f"{CURE}"
        )
    if span > longest:
        fit = f"for wheelsets up to {longest:g} m apart" if longest else "for no vehicle"
        warnings.warn(
            f"{track}: a ring of {length:g} m whose receptance is within {PROMISED:.0%} of an "
            f"endless track's to {PROMISED_TO:g} Hz {fit}; these are {span:g} m apart: {CURE}",
            RingWarning,
            stacklevel=2,
        )


def check_line_of(track: Path, positions: FloatArray) -> None:
    """Check wheelsets against where a track FMU of several kinds is a line; others are all round.

    Parameters
    ----------
    track : Path
        FMU file.
    positions : array, shape (wheelsets,)
        Where they are, or come to, m.

    Raises
    ------
    FmuError
        If what the FMU says is no number.
    CouplingError
        If one is near where the ring is closed.
    """
    noted = read_annotations(track, TOOL).get(RING)
    if noted is None or "kinds" not in noted:
        return
    begin, end = (_finite(track, noted, name) for name in ("from", "to"))
    if not (begin <= positions.min() and positions.max() <= end):
        raise CouplingError(
            f"{track}: is {noted['kinds']}, on a ring that closes where no track does: wheelsets "
            f"from {positions.min():.1f} to {positions.max():.1f} m must stay from {begin:.1f} to "
            f"{end:.1f} m; start elsewhere (--position), run a shorter time, or export the track "
            "with more [mesh] cells of the first or the last kind"
        )


def check_rings_of(fmus: Sequence[LoadedFmu]) -> None:
    """Check all FMUs that have wheelsets on them; see `check_ring_of`."""
    for fmu in fmus:
        places = [x for v, x in zip(fmu.inputs, fmu.u, strict=True) if v.name in POSITIONS]
        if places:
            check_ring_of(fmu.description.path, np.array(places))


def check_frequencies_of(track: Path, highest: float) -> None:
    """Tell that a track FMU of ours is asked beyond what is promised of its ring.

    Parameters
    ----------
    track : Path
        FMU file.
    highest : float
        Frequency, Hz.

    Warns
    -----
    RingWarning
        If it is above `PROMISED_TO`.
    """
    if highest > PROMISED_TO and RING in read_annotations(track, TOOL):
        warnings.warn(
            f"above {PROMISED_TO:g} Hz nothing is promised of the ring in {track.name}: where "
            "hardly anything damps a wave, as at the pinned-pinned resonance, it answers as no "
            "endless track does; railcosim track-receptance tells by how much",
            RingWarning,
            stacklevel=2,
        )


def _number(track: Path, noted: dict[str, str], name: str) -> float:
    value = _finite(track, noted, name)
    if value < 0.0:
        raise _wrong(track, noted, name)
    return value


def _finite(track: Path, noted: dict[str, str], name: str) -> float:
    try:
        value = float(noted[name])
    except (KeyError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise _wrong(track, noted, name)
    return value


def _wrong(track: Path, noted: dict[str, str], name: str) -> FmuError:
    return FmuError(
        f"{track}: its annotation {RING} has {name} = {noted.get(name)!r}: must be a length in m; "
        "export it again"
    )
