"""railcosim compare: coupled FMUs against one monolithic system."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.analysis.pair.owner import Owner

from .fmus import FreshOption, made
from .irregularity_options import IrregularityOptions
from .option_types import (
    ContactStiffness,
    DimensionName,
    DimensionOption,
    Frequencies,
    PositionOption,
    Speed,
)
from .options import (
    UsageError,
    doubted,
    frequencies_of,
    given_here,
    positive,
    speed_of,
    stiffness_of,
)
from .parameter_options import PairOptions
from .progress import foretelling
from .results import folder_of
from .scheme_options import ContactOption, InputsOption, SchemeOption
from .terminal import console
from .uncoupled import compare_uncoupled

if TYPE_CHECKING:
    from railcosim.analysis.comparison.held import Errors


def compare(
    *,
    given: PairOptions,
    fresh: FreshOption = False,
    dimension: DimensionOption = DimensionName.VERTICAL,
    contact_stiffness: ContactStiffness = "1e9",
    frequencies: Frequencies = "0.3:1500:60@log",
    scheme: SchemeOption = None,
    inputs: InputsOption = None,
    contact: ContactOption = None,
    step: Annotated[float, typer.Option(help="Communication step, s.")] = 1e-4,
    time: Annotated[float, typer.Option(help="How long, s.")] = 0.3,
    speed: Speed = 250.0,
    position: PositionOption = None,
    rough: IrregularityOptions,
    uncoupled: Annotated[
        bool,
        typer.Option(
            "--uncoupled",
            help="Compare with simpler models instead: rigid track, no phase lag, rigid contact, "
            "no vehicle. Uses --frequencies, --speed, --position and "
            "--contact-stiffness.",
        ),
    ] = False,
    out: Annotated[
        Path, typer.Option("--out", help="Folder for the page of --uncoupled.", metavar="DIR")
    ] = Path("railcosim-uncoupled"),
    context: typer.Context,
) -> None:
    """Compare coupled FMUs with the monolithic solution, in time and in frequency.

    Time: Newmark with steps four times shorter, wheels held, irregularity moving. Frequency: one
    direct solve of everything at each frequency. In space wheels press by Hertz's law and creep at
    the speed, and forces down and aside and responses to irregularities are compared.

    With --uncoupled: what each part of the coupling changes, and where it may be neglected.
    """
    from railcosim.analysis.compare import compare as compared
    from railcosim.analysis.schemes.choice import choice_of, maker_of
    from railcosim.master.course import count_steps

    if uncoupled:
        folder_of("--out", out)
    if dimension is DimensionName.SPATIAL:
        _refuse_in_space(context)
    k_H = stiffness_of(contact_stiffness)
    chosen, owner = choice_of(scheme, contact)
    v = speed_of(speed)
    count_steps(
        0.0, positive("--time", time, "s"), doubted("--step", positive("--step", step, "s"))
    )
    profile = rough.profile(v * time)
    defects = rough.defects()
    frequency = frequencies_of(frequencies)
    cars, rails = given.pair()
    with made(cars, rails, dimension=dimension, fresh=fresh) as fmus:
        if uncoupled:
            compare_uncoupled(fmus, frequency, k_H, v, out, position)
            return
        found = compared(
            cars, rails, fmus, frequency,
            contact_stiffness=k_H, owner=owner, scheme=maker_of(chosen, inputs)(Owner.VEHICLE),
            step=step, time=time, speed=v, irregularity=profile, defects=defects,
            position=position, stage=foretelling,
        )  # fmt: skip
    shares = ", ".join(f"{name} {error:.2e}" for name, error in found.of_forces.items())
    console.print(
        f"contact forces in time, {found.scheme.describe()}, step {step:g} s: relative RMS error "
        f"of their dynamic part: {shares}"
    )
    title = f"Relative error of the coupled FRF, {found.title}"
    console.print(error_table(found.in_frequency, title))
    found.check()


def _refuse_in_space(context: typer.Context) -> None:
    """Refuse options that say nothing of wheels that roll."""
    why = {
        "contact_stiffness": "in space wheels press by Hertz's law, by the vehicle's [contact]",
        "uncoupled": "its simpler models are vertical",
    }
    for name, reason in why.items():
        if given_here(context, name):
            raise UsageError(
                f"--{name.replace('_', '-')}: {reason}; leave it out, or --dimension spatial"
            )


def _short(output: str) -> str:
    """Without the component in front, which a contact force does not have."""
    from railcosim.analysis.comparison.held import is_force

    return output if is_force(output) else output.partition(".")[2]


def error_table(errors: Errors, title: str) -> Table:
    """Show the worst error of every output."""
    import numpy as np

    from railcosim.analysis.comparison.held import WEAK

    table = Table(
        title=f"{title}\nworst outside 1 % of antiresonances; in brackets: where the response is "
        f"above {WEAK:g} of the largest of its kind"
    )
    table.add_column("output", no_wrap=True)
    for excitation in errors:
        table.add_column(excitation, justify="right")
    for output in next(iter(errors.values())):
        cells = []
        for by_output in errors.values():
            error, strong = by_output[output]
            cells.append(
                f"{np.nanmax(error):.1e} ({np.nanmax(error, where=strong, initial=0):.1e})"
                if np.isfinite(error).any()
                else "-"
            )
        table.add_row(_short(output), *cells)
    return table
