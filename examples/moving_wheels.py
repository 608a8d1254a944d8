"""Co-simulation with wheels that roll over a dip, with nonlinear contact.

python examples/moving_wheels.py [PICTURE]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.fmus.export import export
from railcosim.master.course import Course
from railcosim.master.schemes.jacobi import jacobi
from railcosim.plots.picture import save_picture
from railcosim.plots.results import Group, time_chart
from railcosim.track.irregularity import Dip, flat
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

speed = 250 / 3.6  # m/s
with TemporaryDirectory() as folder:
    fmus = export(Vehicle(), Track(), Path(folder))
    run, stopped = run_pair(
        fmus["Vehicle"],
        fmus["TrackWithContact"],  # the stiff contact sits with the track
        {"contact.nonlinear": True},
        Journey(
            speed=speed,
            held=False,
            profile=flat(),
            defects=(Dip(depth=1e-3, length=2.0, at=25.0),),  # m
        ),
        Course(scheme=jacobi(degree=1), step=1e-4, stop=0.25),  # s
        progress=lambda done, total: None,
    )
if stopped is not None:
    raise stopped  # `run` holds what was recorded until then

force = run["wheelset[1].left.force_z"] / 1e3
print(f"first wheel: {float(force[0]):.1f} kN at rest, up to {float(force.max()):.1f} kN")
forces = {f"wheelset[{i}].left.force_z": f"wheelset {i}" for i in (1, 2, 3, 4)}
chart = time_chart(run, [Group("contact force, left (kN)", forces, 1e-3)])
save_picture(chart, Path(sys.argv[1] if len(sys.argv) > 1 else "dip.png"))
