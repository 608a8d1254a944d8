"""Waves of an endless track: wavenumbers, decay, bands in which none travels."""

from __future__ import annotations

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError
from railcosim.track.cell import EVEN, elements_per_bay
from railcosim.track.decay_rate import NEPER
from railcosim.track.dispersion import TRAVELS, dispersion, fine_enough, stop_bands
from railcosim.track.parameters import Track
from railcosim.track.section import directions_for

from .choices import Rails
from .track_words import direction_of

MOTIONS = {"w": "vertical bending", "v": "lateral bending", "phi": "torsion"}
KMH = 3.6


def track_dispersion(
    track: Track,
    frequency: FloatArray,
    *,
    direction: str = "z",
    rails: Rails = Rails.ALIKE,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Every wave of a track without end, over frequency.

    Parameters
    ----------
    track : Track
        Parameters. Its elements are made as fine as the highest frequency asks for.
    frequency : array, shape (n,)
        Hz, increasing.
    direction : str
        ``z``: waves that move rails down; ``y`` or ``roll``: to the right and in torsion.
    rails : Rails
        Both rails move alike (both down, both to the right), or opposite to each other.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``frequency`` (Hz), for each wave i: ``wave[i].wavenumber`` kappa (rad/m) of
        exp(i (omega t - kappa x)), and ``wave[i].decay`` (dB/m). NaN where a wave decays too fast
        to be told (by 240 dB in a cell). The attribute ``stop_bands`` has the frequencies (Hz, from
        and to, one after the other) between which no wave travels if nothing damps the track;
        ``lowest_phase_velocity`` (km/h) and ``at`` (Hz) are of the waves that travel.

    Raises
    ------
    ArgumentError
        If there is no such direction, or frequencies do not increase from above 0.
    """
    if not (frequency.size and frequency[0] > 0 and (np.diff(frequency) > 0).all()):
        raise ArgumentError("frequencies", None, "must increase, from above 0 Hz")
    along = direction_of("direction", direction)
    fine = fine_enough(track, float(frequency[-1]), along)
    parity = EVEN * along.mirror if rails is Rails.ALIKE else -EVEN * along.mirror
    found = dispersion(
        fine, 2 * np.pi * frequency, along, parity, lambda a, b: progress(0.7 * a / b, 1.0)
    )
    highest = float(frequency[-1])
    gaps = stop_bands(fine, highest, along, parity)
    progress(1.0, 1.0)
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    result = xr.Dataset(coords={"frequency": axis})
    for i, branch in enumerate(found, 1):
        name = {"long_name": f"{_called(track, branch.motion)} ({i})"}
        result[f"wave[{i}].wavenumber"] = (
            "frequency", branch.wavenumber, {"units": "rad/m", **name},
        )  # fmt: skip
        decay = -NEPER * branch.wavenumber.imag
        result[f"wave[{i}].decay"] = "frequency", decay, {"units": "dB/m", **name}
    result.attrs = {
        "title": f"waves of the track, {along.name}, rails {rails.value}",
        "direction": along.name, "rails": rails.value,
        "elements_per_bay": elements_per_bay(
            fine, directions_for([along], coupled=track.rails_tilt)
        ),
        "stop_bands": np.array(gaps).ravel(),
        **_slowest(frequency, np.stack([b.wavenumber for b in found])),
    }  # fmt: skip
    return result


def _called(track: Track, motion: str) -> str:
    """What a wave is called whose energy is mostly that of an unknown of the section."""
    layers = {f"w{i}": f"{layer.called}, bending" for i, layer in enumerate(track.layers)}
    return (MOTIONS | layers)[motion]


def _slowest(frequency: FloatArray, kappa: np.ndarray) -> dict[str, float]:
    """Lowest phase velocity of the waves that travel, km/h, and where; empty if none does."""
    travels = (np.abs(kappa.imag) < TRAVELS * np.abs(kappa.real)) & (kappa.real > 0)
    if not travels.any():
        return {}
    velocity = np.full(kappa.shape, np.inf)
    over = np.broadcast_to(2 * np.pi * frequency, kappa.shape)
    np.divide(over, kappa.real, out=velocity, where=travels)
    at = np.unravel_index(np.argmin(velocity), velocity.shape)
    return {
        "lowest_phase_velocity": KMH * float(velocity[at]),
        "lowest_phase_velocity_at": float(frequency[at[1]]),
    }
