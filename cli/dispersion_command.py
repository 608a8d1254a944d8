"""railcosim dispersion."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.analysis.response.choices import Rails

from .option_types import Frequencies, OutFile, PlotFile
from .options import frequencies_of, speed_of
from .parameter_options import TrackOptions
from .progress import progress
from .receptance import Along
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

TOLD = 6  # stop bands: the widest


def dispersion(
    *,
    given: TrackOptions,
    direction: Annotated[
        Along, typer.Option(help="z: waves that move rails down; y, roll: aside and in torsion.")
    ] = Along.DOWN,
    rails: Annotated[
        Rails, typer.Option(help="alike: both rails down, or both to the right; opposite.")
    ] = Rails.ALIKE,
    frequencies: Frequencies = "5:2000:5",
    speed: Annotated[
        float | None, typer.Option(help="km/h; the line omega = V k of a train in the picture.")
    ] = None,
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Waves of a track without end: wavenumber and decay, and bands where none travels.

    Waves exp(i (omega t - kappa x)) of the finite elements, propagating and evanescent; the lowest
    phase velocity is the speed of a train that catches up with its own waves.
    """
    from railcosim.analysis.response.dispersion import track_dispersion
    from railcosim.plots.waves import dispersion_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    metres_per_second = None if speed is None else speed_of(speed)
    frequency = frequencies_of(frequencies)
    parameters = given.rails()
    with progress("finding waves") as update:
        result = track_dispersion(
            parameters, frequency, direction=direction, rails=rails, progress=update
        )
    _tell(result)
    keep(
        result, out, f"{frequency.size} frequencies", plot,
        partial(dispersion_chart, speed=metres_per_second),
    )  # fmt: skip


def _tell(result: xr.Dataset) -> None:
    edges = result.attrs["stop_bands"].reshape(-1, 2).tolist()
    widest = sorted(sorted(edges, key=lambda e: e[0] - e[1])[:TOLD])
    if widest:
        told = ", ".join(f"{low:.4g} to {high:.4g}" for low, high in widest)
        which = f"the {TOLD} widest of {len(edges)}" if len(edges) > TOLD else f"{len(edges)}"
        console.print(f"stop bands, Hz ({which}; if nothing damps the track): {told}")
    if "lowest_phase_velocity" in result.attrs:
        console.print(
            f"lowest phase velocity: {result.attrs['lowest_phase_velocity']:.0f} km/h, at "
            f"{result.attrs['lowest_phase_velocity_at']:g} Hz"
        )
