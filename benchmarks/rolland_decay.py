"""Mobilities of a rail by rolland at distances from a force (PyPI, Python 3.12 or newer).

Run by benchmarks/decay_rates.py, in whatever Python has rolland. Reads one JSON object from
standard input: numbers of rail, pads and, for a ballasted track, blocks on ballast; frequencies
(Hz); distances (m) from the middle of a bay. Prints ms a frequency, and |mobility| at every
distance, frequency by frequency.
"""

from __future__ import annotations

import json
import sys
from dataclasses import MISSING, fields, replace
from time import perf_counter
from typing import Any

import numpy as np
from rolland.components import Ballast, DiscrPad, Slab, Sleeper
from rolland.database.rail.db_rail import UIC60
from rolland.methods.semi_analytical import TSBDiscr1L, TSBDiscr2L
from rolland.track import SimplePeriodicBallastedSingleRailTrack, SimplePeriodicSlabSingleRailTrack


def filled(cls: type[Any], **known: float) -> Any:
    """An object with ones for what a vertical model does not use."""
    asked = [
        f.name
        for f in fields(cls)
        if f.init and f.default is MISSING and f.default_factory is MISSING
    ]
    return cls(**(dict.fromkeys(asked, 1.0) | known))


def main() -> None:
    """Print the numbers."""
    given = json.load(sys.stdin)
    frequency, away = np.array(given["frequency"]), np.array(given["distances"])
    common = {
        "rail": replace(UIC60, **given["rail"]),
        "distance": given["spacing"], "num_mount": given["mounts"], "z_f": 0.0, "y_f": 0.0,
        "pad": filled(
            DiscrPad, sp_z=given["pad"][0], dp_z=given["pad"][1], dp_y=1.0, dp_x=1.0, dp_xr=1.0
        ),
    }  # fmt: skip
    if given["block"]:
        mass, stiffness, damping = given["block"]
        track: Any = SimplePeriodicBallastedSingleRailTrack(
            **common, sleeper=filled(Sleeper, ms=mass),
            ballast=filled(
                Ballast, sb_z=stiffness, db_z=damping,
                **dict.fromkeys(("db_y", "db_x", "db_xr", "db_yr", "db_zr"), 1.0),
            ),
        )  # fmt: skip
        track.E = np.ones_like(np.asarray(track.E))  # a block: no sleeper that bends, made a mass
        method: Any = TSBDiscr2L
    else:
        track, method = SimplePeriodicSlabSingleRailTrack(**common, slab=filled(Slab)), TSBDiscr1L
    seats = np.array(list(track.mount_prop))
    middle = float((seats[len(seats) // 2] + seats[len(seats) // 2 + 1]) / 2)
    times = []
    for _ in range(3):
        begun = perf_counter()
        model = method(
            track=track, f=frequency, force=np.ones_like(frequency), x_excit=middle,
            x=list(middle + away), damp_type="viscous",
        )  # fmt: skip
        times.append(perf_counter() - begun)
    mobility = np.abs(model.mobility)
    if mobility.shape[0] == away.size:
        mobility = mobility.T
    print(json.dumps({"ms": 1e3 * min(times) / frequency.size, "mobility": mobility.tolist()}))


if __name__ == "__main__":
    main()
