"""Coupled frequency response of two FMUs that know nothing of each other.

Each is linearised exactly, by Model Exchange; the contacts then couple them, frequency by
frequency.

    python examples/coupled_response.py [PICTURE]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from railcosim.analysis.response.frequency import coupled, on_rigid_track, response
from railcosim.analysis.response.models import linear_models
from railcosim.fmus.export import WITH_STATES, export
from railcosim.plots.picture import save_picture
from railcosim.plots.results import receptance_chart
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

frequency = np.geomspace(0.3, 300, 2000)  # Hz
omega = 2 * np.pi * frequency
k_H = 0.3e9  # N/m, of each contact

with TemporaryDirectory() as folder:
    fmus = export(Vehicle(), Track(), Path(folder), runtime=WITH_STATES)
    models = linear_models(fmus["Vehicle"], fmus["Track"], lambda done, total: None)

curves = {}
for name, system in {
    "flexible track": coupled(models, omega, k_H),
    "rigid track": on_rigid_track(models, omega, k_H),
}.items():
    outputs = response(system, "wheelset[4].force_z", models.positions, speed=1.0)
    wheel = outputs[:, system.rows(["vehicle.wheelset[4].left.wheel_z"])[0]]
    curves[name] = (frequency, wheel)
    print(f"wheelset 4 on {name}: {frequency[abs(wheel).argmax()]:.1f} Hz")
save_picture(
    receptance_chart(curves, "receptance (m/N)", "wheelset 4 under a unit force on it"),
    Path(sys.argv[1] if len(sys.argv) > 1 else "coupled.png"),
)
