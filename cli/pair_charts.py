"""What is shown of a run and of a frequency response of the pair."""

from __future__ import annotations

import xarray as xr

from railcosim.plots.chart import Chart
from railcosim.plots.results import Group, size_chart, time_chart

WHEELSETS = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
MOTION = [
    "carbody.z",
    "bogie[1].z",
    "bogie[2].z",
    "wheelset[4].left.wheel_z",
    "wheelset[4].left.rail_z",
]
FIRST = [f"wheelset[1].left.{name}" for name in ("wheel_z", "rail_z", "irregularity_z")]
OVER_TIME = (
    Group("contact force, left (kN)", {f"{w}.left.force_z": w for w in WHEELSETS}, 1e-3),
    Group("down (mm)", {name: name for name in FIRST}, 1e3),
    Group("bogie acceleration (m/s²)", {f"bogie[{i}].az": f"bogie[{i}].az" for i in (1, 2)}),
    Group("car body acceleration (m/s²)", {"carbody.az": "carbody.az"}),
)


def run_chart(run: xr.Dataset) -> Chart:
    """Contact forces, wheel and rail motion, and accelerations over time."""
    return time_chart(run, OVER_TIME)


def response_chart(frf: xr.Dataset) -> Chart:
    """Magnitude of displacements and of contact forces over frequency."""
    per = "m" if str(frf.attrs["excitation"]).endswith("irregularity_z") else "N"
    forces = {f"{w}.left.force_z": f"{w}.left" for w in WHEELSETS}
    groups = (
        Group(f"displacement (m/{per})", {name: name for name in MOTION}),
        Group(f"contact force (N/{per})", forces),
    )
    return size_chart(frf, groups)
