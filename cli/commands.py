"""The commands by name; the module of one is loaded when it is called, not when it is listed."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

import typer
from typer.core import TyperCommand, TyperGroup

from .option_groups import spelled_out

MARKUP: Literal["markdown"] = "markdown"  # "rich" would take the [i] of wheelset[i] for a style


@dataclass(frozen=True)
class Place:
    """Where a command is.

    Attributes
    ----------
    module, function : str
        Of this package.
    panel : str
        Among which commands help lists it.
    summary : str
        The first line of its docstring.
    passes_on : bool
        Whether options that it does not know are another's.
    """

    module: str
    function: str
    panel: str
    summary: str
    passes_on: bool = False


# What the user has in mind, in the order in which help lists them.
START, FMUS, TRACK = "Start", "Any FMUs, yours too", "Track alone"
EITHER, VEHICLE, PAIR = "Track or vehicle", "Vehicle alone", "Vehicle on track"
SCHEMES, RESULTS = "Coupling schemes", "Many runs, results, pictures"

COMMANDS = {
    "demo": Place(
        "demo",
        "demo",
        START,
        "The whole job on the paper's vehicle and slab track, in half a minute to a minute.",
    ),
    "export": Place(
        "export",
        "export",
        START,
        "Write Vehicle, Track, VehicleWithContact, TrackWithContact as FMUs, and Pair.ssp.",
    ),
    "run": Place(
        "run_command",
        "run",
        START,
        "Run a vehicle FMU and a track FMU coupled in time.",
    ),
    "frf": Place(
        "frf",
        "frf",
        START,
        "Linearise a vehicle FMU and a track FMU and couple them in the frequency domain.",
    ),
    "parameters": Place(
        "parameters",
        "parameters",
        START,
        "Print a built-in parameter file, with units, ranges and sources as comments.",
    ),
    "run-system": Place(
        "run_system_command",
        "run_system",
        FMUS,
        "Run any system of FMUs, from an SSP file, coupled in time.",
    ),
    "receptance": Place(
        "receptance",
        "receptance",
        FMUS,
        "Frequency response of any FMU between two variables, from a linear model of it.",
    ),
    "track-receptance": Place(
        "receptance",
        "track_receptance",
        TRACK,
        "Receptance of the rail on a track without end, where it is loaded, by finite elements.",
    ),
    "dispersion": Place(
        "dispersion_command",
        "dispersion",
        TRACK,
        "Waves of a track without end: wavenumber and decay, and bands where none travels.",
    ),
    "decay-rate": Place(
        "decay_rate_command",
        "decay_rate",
        TRACK,
        "Decay rates of the rail by EN 15461, in third octaves, vertical and lateral.",
    ),
    "transmission": Place(
        "transmission_command",
        "transmission",
        TRACK,
        "Force on the foundation in third octaves, slab vibration, insertion loss of a track.",
    ),
    "fit": Place(
        "fit_command",
        "fit",
        TRACK,
        "Find track parameters from a measured receptance or decay rate, with 95 % intervals.",
    ),
    "irregularity": Place(
        "irregularity",
        "irregularity",
        TRACK,
        "Make a random profile of a class of track, and hold its spectrum against the class's.",
    ),
    "modes": Place(
        "modes_command",
        "modes",
        EITHER,
        "Modes of a vehicle in space or of a track, by their names: frequencies and damping.",
    ),
    "sensitivity": Place(
        "sensitivity_command",
        "sensitivity",
        EITHER,
        "How much each parameter moves the resonances of a vehicle, a track, or both.",
    ),
    "critical-speed": Place(
        "critical_speed_command",
        "critical_speed_command",
        VEHICLE,
        "Speed from which on a vehicle hunts, by its poles, for each conicity of its wheels.",
    ),
    "limit-cycle": Place(
        "limit_cycle_command",
        "limit_cycle",
        VEHICLE,
        "How far a vehicle hunts on rigid rails: limit cycles against speed, up and down, in time.",
    ),
    "ride": Place(
        "ride_command",
        "ride_command",
        PAIR,
        "Random response by pseudo-excitation: densities, standard deviations, ride comfort.",
    ),
    "map": Place(
        "map_command",
        "map_command",
        PAIR,
        "Responses to irregularity over its wavelength and the speed, on flexible and rigid track.",
    ),
    "safety": Place(
        "safety_command",
        "safety",
        PAIR,
        "Running safety of a run: Y/Q, sum of guiding forces, wheel unloading, per EN 14363.",
    ),
    "advise": Place(
        "advise_command",
        "advise",
        SCHEMES,
        "Name owner, scheme and step that reach an accuracy at the least cost, before running.",
    ),
    "stability": Place(
        "stability_command",
        "stability",
        SCHEMES,
        "Predict the largest stable step of every scheme, owner of the contact and stiffness.",
    ),
    "compare": Place(
        "compare",
        "compare",
        SCHEMES,
        "Compare coupled FMUs with the monolithic solution, in time and in frequency.",
    ),
    "study": Place(
        "study_command",
        "study",
        SCHEMES,
        "Compare coupling schemes: error against the monolithic solution, growth and cost.",
    ),
    "sweep": Place(
        "sweep_command",
        "sweep",
        RESULTS,
        "Call a command for all combinations of values, on all cores: one dataset, one picture.",
        passes_on=True,
    ),
    "plot": Place(
        "plot_command",
        "plot",
        RESULTS,
        "Draw variables of several results together: as they are, spectra, third octaves, "
        "differences.",
    ),
    "view": Place(
        "view_command",
        "view",
        RESULTS,
        "Write a page that plays a run: vehicle and rail from the side, contact forces.",
    ),
    "paper": Place(
        "paper",
        "paper",
        RESULTS,
        "Reproduce figures 3 to 23 of Xu & Lu (2021): pictures, data, table.csv and report.html.",
    ),
}


def loaded(name: str) -> Any:
    """The command of that name, whole."""
    place = COMMANDS[name]
    function = getattr(import_module(f".{place.module}", __package__), place.function)
    alone = typer.Typer(
        add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=MARKUP
    )
    passing = {"ignore_unknown_options": True, "allow_extra_args": True}
    alone.command(name, context_settings=passing if place.passes_on else None)(
        spelled_out(function)
    )
    return typer.main.get_command(alone)


class Listed(TyperGroup):
    """Commands that are known by their summaries until one is called."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {
            name: TyperCommand(
                name,
                callback=None,
                help=place.summary,
                rich_markup_mode=MARKUP,
                rich_help_panel=place.panel,
            )
            for name, place in COMMANDS.items()
        }

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is called, and its arguments."""
        name, _, rest = super().resolve_command(ctx, args)
        return name, name and loaded(name), rest
