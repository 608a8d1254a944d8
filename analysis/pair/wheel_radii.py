"""How large the wheels of vehicle FMUs are, by what these note in their descriptions."""

from __future__ import annotations

import math

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.fmi.archive import FmuError, read_annotations
from railcosim.master.fmi.description import describe_file

from .contact import layout_of
from .numbering import Vehicles, files_of
from .ring import TOOL

WHEELS = "Wheels"


def wheel_radii(vehicle: Vehicles) -> FloatArray:
    """Of all wheelsets from the front, m; NaN where an FMU, somebody else's, does not tell.

    Raises
    ------
    FmuError
        If what one notes are no radii of its wheelsets.
    """
    found: list[float] = []
    for file in files_of(vehicle):
        about = describe_file(file)
        count = layout_of((file, [*about.inputs, *about.outputs])).wheelsets
        noted = read_annotations(file, TOOL).get(WHEELS, {}).get("radius")
        if noted is None:
            found += [math.nan] * count
            continue
        try:
            radii = [float(word) for word in noted.split()]
        except ValueError:
            radii = []
        if len(radii) != count or not all(0 < radius < math.inf for radius in radii):
            raise FmuError(
                f"{file}: its annotation {WHEELS} has radius = {noted!r}: must be {count} numbers "
                "in m; export it again"
            )
        found += radii
    return np.array(found)
