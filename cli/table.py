"""The paper's resonances from the FMUs, beside the paper's and an independent model's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railcosim.analysis.frequency import Models, apart, coupled, on_rigid_track, response
from railcosim.master.component import FloatArray
from railcosim.master.receptance import FrequencyResponse

POINTS = 600  # a window: 0.2 % apart in the widest
K_H = 0.3e9  # N/m, the paper's in these figures (eq. 19)
SYSTEMS: dict[str, Callable[[Models, FloatArray], FrequencyResponse]] = {
    "rigid track": lambda models, omega: on_rigid_track(models, omega, K_H),
    "coupled": lambda models, omega: coupled(models, omega, K_H),
    "track alone": apart,
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """One number of the paper.

    Attributes
    ----------
    quantity : str
        What it is.
    paper : str
        What the paper prints, Hz.
    independent : float
        What an independent model gives, Hz.
    system, excitation, output : str
        Where it is looked for.
    window : tuple of float
        Between which frequencies, Hz.
    dip : bool
        An antiresonance instead of a resonance.
    note : str
        What a reader should know.
    """

    quantity: str
    paper: str
    independent: float
    system: str
    excitation: str
    output: str
    window: tuple[float, float]
    dip: bool = False
    note: str = ""


WHEEL = "vehicle.wheelset[4].left.wheel_z"
RAIL = "track.wheelset[4].left.rail_z"
ON_WHEELSET, ON_RAILS = "wheelset[4].force_z", "wheelset[4].rail_force_z"
ROWS = [
    Row(
        quantity="car body bounce, rigid track", paper="0.7", independent=0.70,
        system="rigid track", excitation=ON_WHEELSET, output="vehicle.carbody.z",
        window=(0.4, 1.2),
    ),
    Row(
        quantity="front bogie vertical, first peak", paper="0.74", independent=0.76,
        system="coupled", excitation=ON_WHEELSET, output="vehicle.bogie[1].z", window=(0.4, 1.2),
    ),
    Row(
        quantity="car body pitch", paper="0.93", independent=0.92,
        system="rigid track", excitation=ON_WHEELSET, output="vehicle.carbody.pitch",
        window=(0.5, 1.4),
    ),
    Row(
        quantity="rear bogie pitch, second peak", paper="6.2", independent=5.3,
        system="coupled", excitation=ON_WHEELSET, output="vehicle.bogie[2].pitch",
        window=(2.5, 12.0), note="paper not reproducible: critically damped by c_pz",
    ),
    Row(
        quantity="wheel on contact spring, rigid track", paper="93.5", independent=93.5,
        system="rigid track", excitation=ON_WHEELSET, output=WHEEL, window=(50, 150),
    ),
    Row(
        quantity="wheel on track", paper="32.7", independent=32.2,
        system="coupled", excitation=ON_WHEELSET, output=WHEEL, window=(20, 60),
    ),
    Row(
        quantity="rail, first peak, without vehicle", paper="52", independent=53.0,
        system="track alone", excitation=ON_RAILS, output=RAIL, window=(30, 90),
    ),
    Row(
        quantity="rail, first peak, with vehicle", paper="33", independent=32.1,
        system="coupled", excitation=ON_RAILS, output=RAIL, window=(20, 60),
    ),
    Row(
        quantity="rail, antiresonance, with vehicle", paper="< 100", independent=95.0,
        system="coupled", excitation=ON_RAILS, output=RAIL, window=(70, 130), dip=True,
    ),
]  # fmt: skip


def resonances(models: Models) -> list[tuple[Row, float]]:
    """Every row with the frequency (Hz) that the FMUs give."""
    found = []
    for row in ROWS:
        frequency = np.geomspace(*row.window, POINTS)
        system = SYSTEMS[row.system](models, 2 * np.pi * frequency)
        values = response(system, row.excitation, models.positions, speed=1.0)
        size = np.abs(values[:, system.rows([row.output])[0]])
        found.append((row, float(frequency[np.argmin(size) if row.dip else np.argmax(size)])))
    return found
