"""Critical speeds on a map of wavelength and speed, rigid track.

At a critical speed the wavelength suits the distance of the bogies and the frequency a resonance
of the car body.

    python examples/critical_speeds.py [PICTURE]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from railcosim.analysis.response.critical import critical_points
from railcosim.analysis.response.frequency import on_rigid_track
from railcosim.analysis.response.models import linear_models
from railcosim.analysis.response.plane import plane, transfer
from railcosim.analysis.response.resonance import resonance
from railcosim.fmus.export import export
from railcosim.plots.chart import Chart, Map, Mark
from railcosim.plots.picture import save_picture
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

k_H = 1e9  # N/m
wavelength, speed = np.linspace(4, 40, 300), np.linspace(10, 200, 300) / 3.6  # m, m/s
with TemporaryDirectory() as folder:
    fmus = export(Vehicle(), Track(), Path(folder))
    models = linear_models(fmus["Vehicle"], None, lambda done, total: None)  # no track needed

table = transfer(
    lambda omega: on_rigid_track(models, omega, k_H),
    ["vehicle.carbody.z", "vehicle.carbody.pitch"],
    lowest=0.05,
    highest=20.0,
)
frequency = np.linspace(0.4, 1.4, 500)
bounce, pitch = np.abs(table.at(frequency)[:, :, 3]).T  # to irregularity under wheelset 4
points = critical_points(
    models.positions, resonance(frequency, bounce), resonance(frequency, pitch), orders=(1, 2)
)
for p in points:
    print(f"{p.mode}, n = {p.order}: {3.6 * p.speed:.1f} km/h at {p.wavelength:.2f} m")

size = np.abs(plane(table, models.positions, wavelength, speed)[0])
chart = Chart(
    title="car body bounce on rigid track",
    rows=(
        (
            Map(
                x=wavelength,
                y=3.6 * speed,
                z=size.T,
                x_label="wavelength (m)",
                y_label="speed (km/h)",
                z_label="bounce (m per m of irregularity)",
                marks=tuple(
                    Mark(label=f"n = {p.order}", x=p.wavelength, y=3.6 * p.speed)
                    for p in points
                    if p.mode == "car body bounce"
                ),
            ),
        ),
    ),
)
save_picture(chart, Path(sys.argv[1] if len(sys.argv) > 1 else "critical.png"))
