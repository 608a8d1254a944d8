"""Options for the irregularity of a run in time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from railcosim.master.suggest import suggest
from railcosim.track.irregularity import (
    QUALITIES,
    Profile,
    flat,
    read_profile,
    repeated,
    synthesise,
)
from railcosim.track.irregularity.repetition import BLEND
from railcosim.track.irregularity.synthesis import FADE_IN

from .options import UsageError

SEED = 1

Irregularity = Annotated[
    str,
    typer.Option(
        "--irregularity",
        help=f"none, {', '.join(QUALITIES)}, or a CSV file with x,left,right in m.",
    ),
]
SeedOption = Annotated[
    int | None,
    typer.Option("--seed", help=f"Of a class: which of its tracks; {SEED}.", min=0, metavar="N"),
]
FadeOption = Annotated[
    float | None,
    typer.Option(
        "--fade",
        help="Length over which the irregularity fades in ahead of the first wheelset, m; "
        f"{FADE_IN:g} for a class, 0 for a file.",
    ),
]
RepeatOption = Annotated[
    bool,
    typer.Option(
        "--repeat",
        help="Repeat a file that is shorter than the run. Ends that do not meet are blended over "
        f"{BLEND:g} m, at most a quarter of it.",
    ),
]


def profile_of(
    text: str,
    length: float,
    seed: int | None = None,
    fade: float | None = None,
    repeat: bool = False,
) -> Profile:
    """The irregularity of a name or a CSV file, for a run over `length` (m).

    Raises
    ------
    UsageError
        If an option says nothing of this irregularity.
    ParameterError
        If the irregularity does not exist, cannot be read, or ends before the run.
    """
    file = text.lower().endswith(".csv")
    for option, given, known in (
        (f"--seed {seed}", seed is not None, not file and text != "none"),
        (f"--fade {fade}", fade is not None, text != "none"),
        ("--repeat", repeat, file),
    ):
        if given and not known:
            kind = "a file" if file else "none" if text == "none" else "a class"
            raise UsageError(f"{option}: says nothing of --irregularity {text}, which is {kind}")
    if text == "none":
        profile = flat()
    elif file:
        profile = read_profile(Path(text))
    elif text not in QUALITIES:
        names = f"none, {', '.join(QUALITIES)}, or a file that ends in .csv"
        raise UsageError(f"--irregularity {text}: must be {names}{suggest(text, QUALITIES)}")
    else:
        profile = synthesise(text, length, SEED if seed is None else seed)
    if repeat:
        profile = repeated(profile, length)
    profile.check_covers(length)
    return profile if fade is None else replace(profile, fade=fade)
