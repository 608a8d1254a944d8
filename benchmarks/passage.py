"""Force and rail under a vehicle that passes from one kind of track to another, against the place.

Of a run such as that of the picture in docs/track.md:

    railcosim run --set mesh.cells=12 --then ballasted@30 --speed 200 --time 0.3 --irregularity none
    python benchmarks/passage.py passage.nc 30 PICTURE
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.plots.chart import Chart, Curve, Mark, Panel
from railcosim.plots.picture import save_picture

AROUND = 6.0  # m on either side of the joint


def main(run: Path, joint: float, picture: Path) -> None:
    """Draw the wheelsets that pass the joint."""
    panels = []
    with xr.open_dataset(run) as found:
        for what, unit, label in (
            ("force_z", 1e3, "contact force (kN)"),
            ("rail_z", 1e-3, "rail under the wheel, down (mm)"),
        ):
            curves = []
            for i in (1, 2):
                place = found[f"wheelset[{i}].position"].to_numpy() - joint
                value = found[f"wheelset[{i}].left.{what}"].to_numpy() / unit
                near = np.abs(place) < AROUND
                curves.append(Curve(name=f"wheelset {i}, left", x=place[near], y=value[near]))
            mark = Mark(label="joint", x=0.0)
            panels.append(
                Panel(
                    x_label="place from the joint (m)", y_label=label, curves=tuple(curves),
                    marks=(mark,),
                )
            )  # fmt: skip
    title = "From slab track on to ballasted track, 200 km/h"
    save_picture(Chart(title=title, rows=tuple((panel,) for panel in panels)), picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]))
