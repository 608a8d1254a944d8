"""What responds in the frequency domain, as options: vehicle, track, and what is between them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .option_types import DimensionName, LocalOption, PositionsOption
from .options import UsageError, positions_of, stiffness_of
from .parameter_options import FmuOptions

if TYPE_CHECKING:
    from railcosim.analysis.response.local_track import Local


@dataclass(frozen=True, kw_only=True)
class MeetingOptions(FmuOptions):
    """A vehicle and a track, anybody's or ours, and how they meet."""

    dimension: Annotated[
        DimensionName,
        typer.Option(
            "--dimension",
            metavar="NAME",
            help="Of our FMUs: vertical or spatial. In space wheels roll at the speed, as the "
            "vehicle FMU tells, or [rolling] of --vehicle.",
        ),
    ] = DimensionName.VERTICAL
    contact_stiffness: Annotated[
        str | None,
        typer.Option(
            "--contact-stiffness", help="Of FMUs that meet downwards only, N/m; 1e9 if not given."
        ),
    ] = None
    position: PositionsOption = None
    local: LocalOption = None
    believe: Annotated[
        bool,
        typer.Option("--believe", help="Take the response of a vehicle that hunts as it is."),
    ] = False

    @cached_property
    def in_space(self) -> bool:
        """Whether vehicles are, those given or ours."""
        from railcosim.analysis.response.meeting import in_space, wheels_of

        if self.vehicle_fmu:
            return in_space(wheels_of(self.vehicle_fmu))
        return self.dimension is DimensionName.SPATIAL

    def arguments(self) -> dict[str, Any]:
        """What analyses call these options.

        Raises
        ------
        UsageError
            If a contact stiffness is given of wheels that roll.
        """
        given = self.contact_stiffness
        if given is not None and self.dimension is DimensionName.SPATIAL:
            raise UsageError("--contact-stiffness: is of the vertical model; in space wheels roll")
        return {
            "contact_stiffness": None if given is None else stiffness_of(given),
            "stock": self.stock() if self.tells_vehicle else None,
            "position": positions_of(self.position, self),
            "believe": self.believe,
            "local": self._local(),
        }

    def _local(self) -> Local | None:
        """What is different at single places of our track."""
        if not self.local:
            return None
        if self.track_fmu:
            raise UsageError("--local: is of parameters; --track-fmu has its own. Leave one out")
        if self.dimension is DimensionName.SPATIAL:
            raise UsageError("--local: single places change in the vertical model only")
        from railcosim.analysis.response.local_track import Local
        from railcosim.analysis.response.track_words import change_of

        track = self.pair()[1]
        return Local(track, [change_of(track, text) for text in self.local])

    @contextmanager
    def files(self) -> Iterator[tuple[tuple[Path, ...], Path]]:
        """FMUs of vehicles and of the track; parameters say how those of others roll in space.

        Raises
        ------
        UsageError
            If they are the paper's, changed, or there is nothing that they say.
        """
        if self.vehicle_fmu and self.in_space:
            self.check_wheels()
        with self.fmus(dimension=self.dimension, told=self.in_space) as found:
            yield found
