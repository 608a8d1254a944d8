"""Options for the irregularity of a run in time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.track.irregularity import QUALITIES, QUANTITIES
from railcosim.track.irregularity.quantities import ALL
from railcosim.track.irregularity.usual import BLEND, DEFECTS, FADE_IN, SEED

if TYPE_CHECKING:
    from railcosim.track.irregularity import Profile
    from railcosim.track.irregularity.defects import Defect


QUANTITIES_HELP = f"Of a class, with commas: {', '.join(QUANTITIES)}; or {ALL} that it has."


def quantities_of(text: str) -> list[str]:
    """Names from the command line, also with hyphens, as words have them."""
    return [name.strip().replace("-", "_") for name in text.split(",")]


@dataclass(frozen=True, kw_only=True)
class IrregularityOptions:
    """Which irregularity, and how it begins and goes on."""

    irregularity: Annotated[
        str,
        typer.Option(
            "--irregularity",
            help=f"none, {', '.join(QUALITIES)}, or a CSV file with x,left,right in m, down, and "
            "perhaps left_y,right_y, to the right; or with x and quantities.",
        ),
    ] = "german-low"
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed", help=f"Of a class: which of its tracks; {SEED}.", min=0, metavar="N"
        ),
    ] = None
    quantities: Annotated[
        str | None,
        typer.Option(
            "--quantities",
            help=QUANTITIES_HELP.removesuffix(".")
            + "; vertical if not given, all of a run in space.",
            metavar="NAMES",
        ),
    ] = None
    fade: Annotated[
        float | None,
        typer.Option(
            "--fade",
            help="Length over which the irregularity fades in ahead of the first wheelset, m; "
            f"{FADE_IN:g} for a class, 0 for a file.",
        ),
    ] = None
    repeat: Annotated[
        bool,
        typer.Option(
            "--repeat",
            help="Repeat a file that is shorter than the run. Ends that do not meet are blended "
            f"over {BLEND:g} m, at most a quarter of it.",
        ),
    ] = False

    defect: Annotated[
        list[str] | None,
        typer.Option(
            "--defect",
            help=f"A single defect, {', '.join(DEFECTS)}, such as dip:depth=1e-3,length=1,at=30 or "
            "flat:length=0.05,wheel=1.left; repeat it for more.",
            metavar="DEFECT",
        ),
    ] = None

    def defects(self) -> tuple[Defect, ...]:
        """Single defects beside it."""
        if not self.defect:
            return ()
        from railcosim.track.irregularity.named_defects import defects_of

        return defects_of(self.defect)

    def profile(self, length: float, *, spatial: bool = False) -> Profile:
        """The irregularity of a ride of some length, m, perhaps one in space."""
        from railcosim.track.irregularity.named import irregularity

        acting = None if self.quantities is None else quantities_of(self.quantities)
        return irregularity(
            self.irregularity, length, seed=self.seed, fade=self.fade, repeat=self.repeat,
            quantities=acting, spatial=spatial,
        )  # fmt: skip
