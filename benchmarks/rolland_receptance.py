"""Receptance of the paper's rail on a rigid slab by rolland (PyPI, Python 3.12 or newer).

Run by benchmarks/frequency.py, in whatever Python has rolland. Prints ms a frequency and the
receptances (m/N) at the frequencies given in Hz.

    python benchmarks/rolland_receptance.py MOUNTS FREQUENCY...
"""

from __future__ import annotations

import sys
from dataclasses import MISSING, fields, replace
from time import perf_counter
from typing import Any

import numpy as np
from rolland.components import DiscrPad, Slab
from rolland.database.rail.db_rail import UIC60
from rolland.methods.semi_analytical import TSBDiscr1L
from rolland.track import SimplePeriodicSlabSingleRailTrack

RAIL = replace(
    UIC60, E=2.059e11, G=2.059e11 / 2.6, kapz=0.5329, mr=60.64, Iyr=3.215e-5, Ar=7.745e-3,
    rho=60.64 / 7.745e-3, etar=0.0,
)  # fmt: skip


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
    mounts, frequency = int(sys.argv[1]), np.array([float(f) for f in sys.argv[2:]])
    track = SimplePeriodicSlabSingleRailTrack(
        rail=RAIL, slab=filled(Slab), distance=0.625, num_mount=mounts, z_f=0.0, y_f=0.0,
        pad=filled(DiscrPad, sp_z=3e7, dp_z=2.5e4, dp_y=1.0, dp_x=1.0, dp_xr=1.0),
    )  # fmt: skip
    seat = float(np.array(list(track.mount_prop))[mounts // 2])
    times = []
    for _ in range(4):  # the first one warms up
        begun = perf_counter()
        model = TSBDiscr1L(
            track=track, f=frequency, force=np.ones_like(frequency), x_excit=seat, x=seat,
            damp_type="viscous",
        )  # fmt: skip
        times.append(perf_counter() - begun)
    print(1e3 * min(times[1:]) / frequency.size, *np.abs(model.receptance.ravel()))


if __name__ == "__main__":
    main()
