"""The track that an FMU carries: reduced, with what is different on it, under so many wheelsets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import DIMENSIONS, SIDES, Layout
from railcosim.parameters import ParameterError
from railcosim.track.closed_line import ClosedLine, check_places
from railcosim.track.decay import check_ring
from railcosim.track.local import LocalChange
from railcosim.track.local_modes import with_changes
from railcosim.track.parameters import Track
from railcosim.track.reduced import ReducedTrack, reduce_track
from railcosim.track.reduced_line import reduce_line
from railcosim.track.section import VERTICAL

from .interface import Start


def check_dimension(dimension: str) -> None:
    """Refuse what is none of `railcosim.mechanics.ports.DIMENSIONS`.

    Raises
    ------
    ParameterError
        Saying what there is.
    """
    if dimension not in DIMENSIONS:
        raise ParameterError(f"dimension = {dimension}: must be one of {', '.join(DIMENSIONS)}")


def track_under(
    track: Track,
    start: Start,
    progress: Callable[[str], None],
    *,
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> ModalBody:
    """The reduced track under so many wheelsets, if the ring is long enough for them."""
    check_dimension(dimension)
    directions = DIMENSIONS[dimension]
    progress("measuring the decay along the track")
    layout = Layout(len(start.positions), sides, directions)
    if line is not None:
        return _line_under(line, start, progress, dimension, changes).under(layout)
    check_ring(track, float(np.ptp(start.positions)))
    progress("reducing the track")
    bare = replace(track, sensor=()) if changes else track  # what is seen is of the changed ring
    reduced = reduce_track(bare, directions)
    if changes:
        reduced = with_changes(
            track, reduced, changes, lambda text: progress(f"finding the changed ring: {text}")
        )
    return reduced.under(layout)


def _line_under(
    line: ClosedLine,
    start: Start,
    progress: Callable[[str], None],
    dimension: str,
    changes: Sequence[LocalChange],
) -> ReducedTrack:
    """Of several kinds, if wheelsets stand where it is a line."""
    if DIMENSIONS[dimension] != VERTICAL:
        raise ParameterError(
            f"dimension = {dimension}: tracks of several kinds are vertical in time; must be "
            "vertical, or one kind"
        )
    if changes:
        raise ParameterError(
            f"{changes[0]}: in time single places are different on a track of one kind only; leave "
            "out it or the kinds that follow"
        )
    check_places(line, start.positions)
    return reduce_line(line, lambda text: progress(f"joining kinds of track: {text}"))
