"""Frequencies of a track that have names."""

from __future__ import annotations

import numpy as np
import xarray as xr

from railcosim.mechanics.ports import Direction
from railcosim.parameters import ParameterError
from railcosim.track.cell import EVEN, ODD, independent
from railcosim.track.named_modes import NamedMode, named_modes
from railcosim.track.parameters import Track
from railcosim.track.section import SPATIAL, VERTICAL
from railcosim.track.stack import check_directions

SAME = 1e-6  # relative difference of frequencies that are one, however the rails move
ASIDE = ("lateral", "torsion")


def track_modes(track: Track | None = None) -> xr.Dataset:
    """Where waves begin to run along a track without end, and where rails swing between railseats.

    Parameters
    ----------
    track : Track, optional
        The paper's if not given. One with layers that have no lateral stiffness is asked for
        vertical modes only.

    Returns
    -------
    Dataset
        Over ``name``: ``undamped_frequency`` (Hz), ``damping_ratio`` (of the undamped shape) and
        ``share``, the part of its mass that moves as the name says.
    """
    track = track or Track()
    found: dict[str, NamedMode] = {}
    for directions in independent(track, asked_of(track)):
        modes = {parity: named_modes(track, directions, parity) for parity in (EVEN, ODD)}
        for parity, some in modes.items():
            found |= called(some, modes[-parity], parity)
    order = sorted(found, key=lambda name: found[name].frequency)
    return xr.Dataset(
        {
            "undamped_frequency": (
                "name", [found[n].frequency for n in order],
                {"units": "Hz", "long_name": "natural frequency without dampers"},
            ),
            "damping_ratio": (
                "name", [found[n].damping_ratio for n in order],
                {"units": "1", "long_name": "of the undamped shape"},
            ),
            "share": (
                "name", [found[n].share for n in order],
                {"units": "1", "long_name": "of its mass that moves as the name says"},
            ),
        },
        {"name": ("name", np.array(order))},
        {"title": "modes of the track"},
    )  # fmt: skip


def asked_of(track: Track) -> tuple[Direction, ...]:
    """Directions in which it moves."""
    try:
        check_directions(track, SPATIAL)
    except ParameterError:  # layers without lateral stiffness
        return VERTICAL
    return SPATIAL


def called(some: list[NamedMode], others: list[NamedMode], parity: int) -> dict[str, NamedMode]:
    """Modes of one parity by names that say how rails move, where the other parity differs."""
    frequency = {mode.name: mode.frequency for mode in others}
    found = {}
    for mode in some:
        same = abs(frequency.get(mode.name, 0.0) / mode.frequency - 1) < SAME
        found[mode.name if same else f"{mode.name} ({_rails(mode, parity)})"] = mode
    return found


def _rails(mode: NamedMode, parity: int) -> str:
    """Whether both rails go down, or to the right, or one against the other."""
    aside = any(word in mode.name for word in ASIDE)
    return "rails alike" if (parity == EVEN) != aside else "rails opposite"
