"""Where wheelsets stand while an FMU is linearised."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TypedDict

from railcosim.master.fmi.description import describe_file
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout
from railcosim.parameters import ArgumentError

POSITIONS = frozenset(Layout(MOST_WHEELSETS).of_axles("position"))
PARAMETER = "start_position"


class Standing(TypedDict, total=False):
    """What of `railcosim.master.linear.linear_fmu.Wanted` says so."""

    at: dict[str, float]
    parameters: dict[str, float]


def standing(fmu: Path, position: float | None) -> Standing:
    """Inputs or a parameter of an FMU for which its last wheelset stands at a position.

    Parameters
    ----------
    fmu : Path
        Of a track, whose wheelsets keep their distances, or of a vehicle.
    position : float or None
        m; None leaves all as the FMU has it.

    Raises
    ------
    ArgumentError
        If the position is no number, or the FMU knows of no wheelsets.
    """
    if position is None:
        return {}
    if not math.isfinite(position):
        raise ArgumentError("position", position, "must be a number of m")
    about = describe_file(fmu)
    if PARAMETER in about.parameters:
        return {"parameters": {PARAMETER: position}}
    starts = {v.name: v.start for v in about.inputs if v.name in POSITIONS}
    if not starts:
        raise ArgumentError(
            "position", position,
            f"{fmu} has no input wheelset[1].position and no parameter {PARAMETER}, so nothing of "
            "it stands elsewhere; leave the option out",
        )  # fmt: skip
    last = min(starts.values())
    return {"at": {name: start - last + position for name, start in starts.items()}}
