"""railcosim compare --uncoupled: its page, table and data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from .progress import progress
from .results import keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.analysis.response.uncoupled import Change
    from railcosim.master.component import FloatArray
    from railcosim.plots.page import Section

FINE = 6000
"""Frequencies, as many as resonances and third octaves need."""

TEXTS = {
    "flexible track": "Rigid track: the wheels stand on their contact springs alone. Unit "
    "irregularity, met by each wheelset with its lag.",
    "phase lag": "No phase lag: all wheelsets meet the irregularity together.",
    "contact flexibility": "Rigid contact: wheel and rail follow the irregularity exactly.",
    "vehicle": "No vehicle: the rail under a unit force on each rail at wheelset 1.",
}


def compare_uncoupled(
    fmus: Mapping[str, Path],
    frequency: FloatArray,
    k_H: float,
    speed: float,
    out: Path,
    position: float | None,
) -> None:
    """Write ``uncoupled.html`` and ``uncoupled.nc``, and print what each part changes."""
    import numpy as np

    from railcosim.analysis.pair.ring import check_frequencies_of
    from railcosim.analysis.response.models import linear_models
    from railcosim.analysis.response.uncoupled import NEGLIGIBLE, changes
    from railcosim.plots.page import write_page

    with progress("linearising") as update:
        models = linear_models(fmus["Vehicle"], fmus["Track"], update, position)
    check_frequencies_of(fmus["Track"], float(frequency[-1]))
    frequency = np.geomspace(frequency[0], frequency[-1], max(FINE, frequency.size))
    found = changes(models, frequency, k_H, speed)
    out.mkdir(parents=True, exist_ok=True)
    keep(_dataset(found, frequency, contact_stiffness=k_H, speed=speed), out / "uncoupled.nc")
    sections = [_section(part, [c for c in found if c.part == part], frequency) for part in TEXTS]
    write_page(
        sections,
        out / "uncoupled.html",
        title="What coupling changes",
        intro=f"The coupled vehicle and track against simpler models, k_H {k_H / 1e9:g} GN/m, "
        f"{3.6 * speed:g} km/h. A part may be neglected in the third octaves where leaving it out "
        f"changes the response by less than {NEGLIGIBLE:g} dB.",
        about={"speed": f"{3.6 * speed:g} km/h", **models.attributes},
        place="without",
        columns=("coupled", "without"),
    )
    console.print(_table(found))
    console.print(f"open {out / 'uncoupled.html'}")


def _section(part: str, found: list[Change], frequency: FloatArray) -> Section:
    from railcosim.plots.chart import Chart, Curve, Panel
    from railcosim.plots.names import words_of
    from railcosim.plots.page import Row, Section

    rows = []
    for c in found:
        span = (float(frequency[0]), float(frequency[-1]))
        named = ", ".join(words_of(c.output) or (c.output,))
        curves = (
            Curve(name="coupled", x=frequency, y=c.with_part),
            Curve(name=f"without {part}", x=frequency, y=c.without_part, dashed=True),
        )
        rows.append(
            (
                Panel(x_label="frequency (Hz)", y_label=f"|{named}| ({c.unit})", curves=curves,
                      x_log=True, y_log=True, x_range=span),
                Panel(x_label="frequency (Hz)", y_label="change (dB)",
                      curves=(Curve(name="third octaves", x=c.centres, y=c.decibel),),
                      x_log=True, x_range=span),
            )
        )  # fmt: skip
    compared = [
        Row(place=part, quantity=f"{c.output}, where it is largest", first=c.resonance_with,
                second=c.resonance_without, unit="Hz",
                note=f"changes by {c.decibel.min():+.1f} to {c.decibel.max():+.1f} dB; may be "
                f"neglected: {c.where_negligible()}")
        for c in found
    ]  # fmt: skip
    return Section(
        heading=f"Without {part}: what changes", text=TEXTS[part],
        chart=Chart(title=f"without {part}", rows=tuple(rows)), rows=compared,
        files=("uncoupled.nc",),
    )  # fmt: skip


def _dataset(found: list[Change], frequency: FloatArray, **attributes: object) -> xr.Dataset:
    import numpy as np
    import xarray as xr

    hertz = {"units": "Hz"}
    variables = {}
    for c in found:
        name = f"{c.output} without {c.part}".replace(" ", "_")
        about = {"units": c.unit, "long_name": c.output}
        variables[f"{name}.coupled"] = ("frequency", c.with_part, about)
        variables[name] = ("frequency", c.without_part, about)
        variables[f"{name}.change"] = ("centre", c.decibel, {"units": "dB"})
    axes = {
        "frequency": ("frequency", frequency, hertz),
        "centre": ("centre", np.asarray(found[0].centres), hertz),
    }
    return xr.Dataset(variables, axes, dict(attributes))


def _table(found: list[Change]) -> Table:
    table = Table(title="What coupling changes: resonance (Hz), response in third octaves (dB)")
    for heading in ("without", "output", "coupled", "without it", "change", "may be neglected"):
        table.add_column(heading)
    for c in found:
        change = f"{c.decibel.min():+.1f} to {c.decibel.max():+.1f}"
        resonances = (f"{c.resonance_with:.4g}", f"{c.resonance_without:.4g}")
        table.add_row(c.part, c.output, *resonances, change, c.where_negligible())
    return table
