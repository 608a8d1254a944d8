"""railcosim irregularity."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.track.irregularity import QUALITIES
from railcosim.track.irregularity.usual import SEED

from .options import PlotFile, console, positive
from .results import PICTURES, Suffixes, draw

if TYPE_CHECKING:
    from railcosim.plots.chart import Chart
    from railcosim.track.irregularity import Profile, Quality


PROFILES = Suffixes("--out", (".csv",))
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
    cross_level: Annotated[
        bool, typer.Option("--cross-level", help="Left and right rail differ by the class's.")
    ] = False,
    plot: PlotFile = None,
) -> None:
    """Make a random profile of a class of track, and hold its spectrum against the class's."""
    import numpy as np

    from railcosim.track.irregularity import read_profile, synthesise, write_profile
    from railcosim.track.irregularity.synthesis import quality

    PROFILES.check(out)
    PICTURES.check(plot)
    if name.lower().endswith(".csv"):
        profile, target = read_profile(Path(name)), None
    else:
        positive("--length", length, "m")
        waves = (positive("--shortest", shortest, "m"), longest)
        target = quality(name)
        profile = synthesise(name, length, seed, wavelengths=waves, coherent=not cross_level)
        n = int(np.searchsorted(profile.x, length)) + 1
        profile = replace(profile, x=profile.x[:n], left=profile.left[:n], right=profile.right[:n])
    chart = None if plot is None else _chart(profile, target)
    write_profile(profile, out)
    deviation = [1e3 * float(z.std()) for z in (profile.left, profile.right)]
    console.print(
        f"{out}: {profile.length:g} m, standard deviation left {deviation[0]:.3g} "
        f"mm, right {deviation[1]:.3g} mm",
    )
    if plot is not None and chart is not None:
        draw(chart, plot)


def _chart(profile: Profile, target: Quality | None) -> Chart:
    import numpy as np

    from railcosim.plots.chart import Chart, Curve, Panel
    from railcosim.track.irregularity import estimated_density

    heights = tuple(
        Curve(name=side, x=profile.x, y=1e3 * z)
        for side, z in (("left", profile.left), ("right", profile.right))
    )
    Omega, S = estimated_density(profile, SEGMENT * profile.length)
    curves = [Curve(name="this profile, left", x=Omega, y=S)]
    if target is not None:
        side = target.vertical.density(Omega)
        title = target.vertical.title
        if target.cross_level is not None and not np.array_equal(profile.left, profile.right):
            side = side + target.cross_level.density(Omega) / 4
            title += " and cross-level"
        curves.append(Curve(name=title, x=Omega, y=side, dashed=True))
    span = (float(Omega[0]), float(Omega[-1]))
    return Chart(
        title=profile.name,
        rows=(
            (Panel(x_label="along the track (m)", y_label="down (mm)", curves=heights,
                   x_range=(float(profile.x[0]), float(profile.x[-1]))),),
            (Panel(x_label="wavenumber (rad/m)", y_label="one-sided density (m²/(rad/m))",
                   curves=tuple(curves), x_log=True, y_log=True, x_range=span),),
        ),
    )  # fmt: skip
