"""railcosim ride."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.track.irregularity import QUALITIES

from .meeting_options import MeetingOptions
from .option_types import Frequencies, Out, PlotFile, Speed
from .options import frequencies_of, speed_of
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.plots.chart import Chart


SHOWN = {
    "acceleration ((m/s²)²/Hz)": [
        "carbody.az", "floor above front bogie", "bogie[1].az", "carbody.ay", "bogie[1].ay",
    ],
    "contact force (N²/Hz)": [
        "wheelset[1].left.force_z", "wheelset[4].left.force_z", "wheelset[1].left.force_y",
    ],
}  # fmt: skip
"""What of it there is; aside only in space."""


def ride_command(
    out: Out,
    pair: MeetingOptions,
    name: Annotated[
        str, typer.Option("--class", help=f"Class of the track: {', '.join(QUALITIES)}.")
    ] = "german-low",
    speed: Speed = 250.0,
    frequencies: Frequencies = "0.3:300:3000@log",
    plot: PlotFile = None,
) -> None:
    """Random response by pseudo-excitation: densities, standard deviations, ride comfort.

    A vertical vehicle does not roll, so both rails are alike; in space all quantities of the class
    act, and comfort aside is told. Comfort after ISO 2631-1 and Sperling (Wz).
    """
    from railcosim.analysis.response.ride import ride
    from railcosim.track.irregularity.synthesis import quality

    RESULTS.check(out)
    PICTURES.check(plot)
    arguments, v = pair.arguments(), speed_of(speed)
    frequency, title = (
        frequencies_of(frequencies),
        quality(name).vertical.title.removesuffix(", vertical"),
    )
    with pair.files() as (vehicle, track), progress("linearising") as update:
        result = ride(
            vehicle, track, frequency, irregularity=name, speed=v, progress=update, **arguments
        )
    console.print(_table(result, f"{title}, {speed:g} km/h"))
    chart = partial(_chart, title=f"{name}, {speed:g} km/h")
    keep(result, out, f"{frequency.size} frequencies", plot, chart)


def _table(result: xr.Dataset, title: str) -> Table:
    table = Table(title=title, pad_edge=False)
    table.add_column("", no_wrap=True)  # wheelset[1].az and wheelset[1].left.force_z, not both cut
    for heading in ("standard deviation", "ISO 2631", "Wz"):
        table.add_column(heading)
    table.add_column("people say", min_width=len("uncomfortable"))
    for name, variable in result.data_vars.items():
        if ".right." in str(name):
            continue  # as on the left: each quantity is its own mirror image, or turned round
        about = variable.attrs
        unit = "m/s²" if about["units"].startswith("(m") else "N"
        felt = ["", "", ""]
        if "sperling" in about:
            felt = [
                f"{about['iso_2631']:.3f} m/s² {about['weighting']}",
                f"{about['sperling']:.2f}",
                about["reaction"],
            ]
        table.add_row(str(name), f"{about['standard_deviation']:.3g} {unit}", *felt)
    return table


def _chart(result: xr.Dataset, title: str) -> Chart:
    import numpy as np

    from railcosim.plots.chart import Chart, Curve, Panel
    from railcosim.plots.names import words_of

    f = np.asarray(result["frequency"])
    rows = tuple(
        (
            Panel(
                x_label="frequency (Hz)", y_label=label, x_log=True, y_log=True,
                curves=tuple(
                    Curve(name=", ".join(words_of(n) or (n,)), x=f, y=np.asarray(result[n]))
                    for n in names
                    if n in result
                ),
                x_range=(float(f[0]), float(f[-1])),
            ),
        )
        for label, names in SHOWN.items()
    )  # fmt: skip
    return Chart(title=title, rows=rows, share_x=True)
