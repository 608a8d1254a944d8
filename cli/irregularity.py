"""railcosim irregularity."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.track.irregularity import QUALITIES, QUANTITIES
from railcosim.track.irregularity.quantities import ASIDE, DOWN
from railcosim.track.irregularity.usual import SEED

from .irregularity_options import QUANTITIES_HELP, quantities_of
from .option_types import PlotFile
from .options import positive
from .results import PICTURES, Suffixes, draw
from .terminal import console

if TYPE_CHECKING:
    from railcosim.plots.chart import Chart, Curve
    from railcosim.track.irregularity import Profile, Spectrum


PROFILES = Suffixes("--out", (".csv",))
WAYS = {DOWN: "", ASIDE: " aside"}  # what is said of a rail there
SEGMENT = 0.25  # of a profile's length: a compromise of scatter and longest wave


def irregularity(
    out: Annotated[Path, typer.Option("--out", help="Profile, CSV.", metavar="FILE.csv")],
    name: Annotated[
        str, typer.Option("--class", help=f"{', '.join(QUALITIES)}, or a CSV file to look at.")
    ] = "german-low",
    length: Annotated[float, typer.Option(help="m")] = 1000.0,
    seed: Annotated[int, typer.Option(help="Which track of the class.", min=0)] = SEED,
    shortest: Annotated[float, typer.Option(help="Wavelength, m.")] = 0.8,
    longest: Annotated[float, typer.Option(help="Wavelength, m.")] = 50.0,
    quantities: Annotated[
        str, typer.Option("--quantities", help=QUANTITIES_HELP, metavar="NAMES")
    ] = "vertical",
    plot: PlotFile = None,
) -> None:
    """Make a random profile of a class of track, and hold its spectrum against the class's.

    Down and to the right are positive. The cross-level is the left rail's height less the right's;
    a positive gauge is wider, half of it on each rail.
    """
    import numpy as np

    from railcosim.track.irregularity import read_profile, synthesise, write_profile
    from railcosim.track.irregularity.synthesis import spectra_of

    PROFILES.check(out)
    PICTURES.check(plot)
    if name.lower().endswith(".csv"):
        profile, spectra = read_profile(Path(name)), {}
    else:
        positive("--length", length, "m")
        waves = (positive("--shortest", shortest, "m"), longest)
        acting = quantities_of(quantities)
        spectra = spectra_of(name, acting)
        profile = synthesise(name, length, seed, wavelengths=waves, quantities=acting)
        n = int(np.searchsorted(profile.x, length)) + 1
        profile = profile.with_rails(
            profile.x[:n], {place: rail[:n] for place, rail in profile.rails.items()}
        )
    chart = None if plot is None else _chart(profile, spectra)
    write_profile(profile, out)
    deviation = ", ".join(
        f"{side}{WAYS[direction]} {1e3 * float(rail.std()):.3g} mm"
        for (direction, side), rail in profile.rails.items()
    )
    console.print(f"{out}: {profile.length:g} m, standard deviation {deviation}")
    if plot is not None and chart is not None:
        draw(chart, plot)


def _chart(profile: Profile, spectra: dict[str, Spectrum]) -> Chart:
    """A row of rails and one of densities, of what is down and of what is aside side by side."""
    from railcosim.plots.chart import Chart, Panel

    ways = [way for way in WAYS if (way, "left") in profile.rails]
    x_range = float(profile.x[0]), float(profile.x[-1])
    lies = tuple(
        Panel(
            x_label="along the track (m)",
            y_label="down (mm)" if way == DOWN else "to the right (mm)",
            curves=_rails(profile, way), x_range=x_range,
        )
        for way in ways
    )  # fmt: skip
    densities = tuple(
        Panel(
            x_label="wavenumber (rad/m)", y_label="one-sided density (m²/(rad/m))",
            curves=_densities(profile, spectra, way), x_log=True, y_log=True,
        )
        for way in ways
    )  # fmt: skip
    return Chart(title=profile.name, rows=(lies, densities))


def _rails(profile: Profile, way: str) -> tuple[Curve, ...]:
    from railcosim.plots.chart import Curve

    return tuple(
        Curve(name=side, x=profile.x, y=1e3 * rail)
        for (direction, side), rail in profile.rails.items()
        if direction == way
    )


def _densities(profile: Profile, spectra: dict[str, Spectrum], way: str) -> tuple[Curve, ...]:
    """Of the quantities that act: this profile's, and the class's dashed."""
    from railcosim.plots.chart import Curve
    from railcosim.track.irregularity import estimated_density

    curves = []
    for name, values in profile.quantities.items():
        if QUANTITIES[name].direction != way or not values.any():
            continue
        Omega, S = estimated_density(profile, SEGMENT * profile.length, name)
        word = name.replace("_", "-")
        curves.append(Curve(name=f"{word}, this profile", x=Omega, y=S))
        if name in spectra:
            density = spectra[name].density(Omega)
            curves.append(Curve(name=f"{word}, class", x=Omega, y=density, dashed=True))
    return tuple(curves)
