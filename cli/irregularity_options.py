"""Options for the irregularity of a run in time."""

from __future__ import annotations

from typing import Annotated

import typer

from railcosim.track.irregularity import QUALITIES
from railcosim.track.irregularity.named import SEED
from railcosim.track.irregularity.repetition import BLEND
from railcosim.track.irregularity.synthesis import FADE_IN

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
