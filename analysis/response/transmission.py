"""Forces on the foundation of a track, and what another track makes of them: third octaves.

References
----------
ISO 14837-1:2005, Mechanical vibration: ground-borne noise and vibration arising from rail systems:
insertion loss is 20 log10 of what the ground gets without over what it gets with a measure, the
train and its irregularities being the same. ISO 1683:2015: velocity levels re 1 nm/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.law import tangent_stiffness
from railcosim.track.ground import force_along, force_on_ground
from railcosim.track.irregularity.spectra import Spectrum
from railcosim.track.irregularity.synthesis import quality
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, infinite_receptance, shortest
from railcosim.vehicle.multibody import Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .decay_rate import LINES, bands_of, lines_of
from .frf import SPEED
from .track_words import place_of

FIRST = 0  # the band of 1 Hz
REFERENCE = 1e-9  # m/s: 1e-6 mm/s
AGAINST = "against."


class Excitation(Protocol):
    """What acts on the rails."""

    @property
    def per(self) -> str:
        """Behind the unit of what it makes."""

    def lines(self, centre: FloatArray) -> int:
        """How many lines a third octave needs."""

    def loads(self, track: Track, position: str | float) -> list[Point]:
        """Where it acts."""

    def forces(self, track: Track, frequency: FloatArray, loads: list[Point]) -> ComplexArray:
        """Forces there, (n, n_loads); the sum of their squares in a band is the mean square."""


@dataclass(frozen=True)
class UnitForce:
    """1 N on one rail, at every frequency."""

    per: str = "/N"

    def lines(self, centre: FloatArray) -> int:
        """See `Excitation`."""
        del centre
        return LINES

    def loads(self, track: Track, position: str | float) -> list[Point]:
        """See `Excitation`."""
        return [Point(x=place_of(track, position))]

    def forces(self, track: Track, frequency: FloatArray, loads: list[Point]) -> ComplexArray:
        """See `Excitation`."""
        del track, loads
        return np.full((frequency.size, 1), LINES**-0.5, dtype=complex)


@dataclass(frozen=True)
class Irregularity:
    """A vehicle whose wheelsets meet a random irregularity with their lag; both rails alike.

    Attributes
    ----------
    body : Multibody
        The vehicle, vertical.
    stiffness : array, shape (n_wheelsets,)
        Of one contact of each, N/m.
    speed : float
        m/s.
    spectrum : Spectrum
        Of the irregularity.
    """

    body: Multibody
    stiffness: FloatArray
    speed: float
    spectrum: Spectrum
    per: str = ""

    def lines(self, centre: FloatArray) -> int:
        """Two to a turn of the phase between the first wheelset and the last, at least."""
        widest = float(centre[-1]) * (10**0.05 - 10**-0.05)
        span = float(np.ptp(self.body.wheelset_x))
        return max(LINES, int(np.ceil(2 * widest * span / self.speed)))

    def loads(self, track: Track, position: str | float) -> list[Point]:
        """The last wheelset stands at the position."""
        x = self.body.wheelset_x - self.body.wheelset_x[-1] + place_of(track, position)
        return [Point(x=float(one), side=BOTH) for one in x]

    def forces(self, track: Track, frequency: FloatArray, loads: list[Point]) -> ComplexArray:
        """Of one wheel of each wheelset.

        Both wheels of a wheelset push it; what contacts, rails and wheelsets give way by closes the
        irregularity.
        """
        omega, body = 2 * np.pi * frequency, self.body
        w = omega[:, None, None]
        D = body.K + 1j * w * body.C - w**2 * body.M
        n, at = len(body.K), body.wheelsets
        wheels = np.linalg.solve(D, np.broadcast_to(np.eye(n)[:, at], (omega.size, n, at.size)))
        seen = [Point(x=one.x) for one in loads]
        rails = infinite_receptance(track, omega, loads, seen)
        closing = 2 * wheels[:, at] + rails + np.diag(1 / self.stiffness)
        behind = body.wheelset_x[0] - body.wheelset_x
        lag = np.exp(-1j * omega[:, None] * behind / self.speed)
        per_hertz = self.spectrum.density(omega / self.speed) * 2 * np.pi / self.speed
        amplitude = np.sqrt(per_hertz * _widths(frequency))
        solved = np.linalg.solve(closing, -(amplitude[:, None] * lag)[..., None])
        return np.asarray(solved[..., 0], complex)


def _widths(frequency: FloatArray) -> FloatArray:
    """Of the parts of third octaves that lines stand for."""
    band = np.round(10 * np.log10(frequency))
    _, which, count = np.unique(band, return_inverse=True, return_counts=True)
    width: FloatArray = (10 ** ((band + 0.5) / 10) - 10 ** ((band - 0.5) / 10)) / count[which]
    return width


def irregularity_under(
    vehicle: Vehicle | Train | None = None,
    *,
    irregularity: str = "german-low",
    speed: float = SPEED,
    contact_stiffness: float | None = None,
) -> Irregularity:
    """What a vehicle that meets an irregularity does to rails.

    Parameters
    ----------
    vehicle : Vehicle or Train, optional
        Parameters; the paper's if not given.
    irregularity : str
        Class of the track, whose vertical spectrum counts.
    speed : float
        m/s.
    contact_stiffness : float, optional
        Of every contact, N/m; Hertz's at the static load of each if not given.
    """
    body = build_multibody(vehicle or Vehicle())
    hertz = tangent_stiffness(body.hertz_coefficient, body.wheel_load)
    k = hertz if contact_stiffness is None else np.full(hertz.shape, contact_stiffness)
    return Irregularity(body, k, speed, quality(irregularity).vertical)


def transmission(
    track: Track | None = None,
    against: Track | None = None,
    *,
    excitation: Excitation | None = None,
    lowest: float = 4.0,
    highest: float = 315.0,
    position: str | float = "railseat",
    progress: Progress = unheard,
) -> xr.Dataset:
    """Force on the foundation of a track without end, and its insertion loss against another.

    Parameters
    ----------
    track : Track, optional
        Parameters; the paper's if not given.
    against : Track, optional
        What its insertion loss is against.
    excitation : Excitation, optional
        `UnitForce` on one rail if not given, or `irregularity_under` a vehicle.
    lowest, highest : float
        Hz, in the first and in the last third octave.
    position : str or float
        Of the force, or of the last wheelset: ``railseat``, ``midspan``, or m.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``frequency``, centres of third octaves (Hz), root mean squares in each: ``force`` on
        all of the foundation (N per N, of a vehicle N), ``force_per_metre``, the most on a bay or
        slab that is loaded over its length, ``slab_velocity`` in the middle between the rails
        beside the last load and ``slab_level``, 20 log10 of it, dB re 1e-6 mm/s. The same of
        the other track with ``against.`` in front, and ``insertion_loss`` (dB), 20 log10 of
        its force over this.

    Raises
    ------
    ArgumentError
        If there is no such band or place.
    """
    acts = excitation or UnitForce()
    centre = 10 ** (bands_of(lowest, highest, FIRST) / 10)
    frequency = lines_of(centre, acts.lines(centre))
    axis = ("frequency", centre, {"units": "Hz", "long_name": "centre of the third octave"})
    result = xr.Dataset(coords={"frequency": axis})
    tracks = {"": track or Track(), **({} if against is None else {AGAINST: against})}
    for k, (name, one) in enumerate(tracks.items()):
        for what, (values, about) in _of_track(one, acts, frequency, position).items():
            squared = np.sum(np.abs(values.reshape(centre.size, -1)) ** 2, axis=1)
            result[f"{name}{what}"] = "frequency", np.sqrt(squared), about
        if f"{name}slab_velocity" in result:
            level = 20 * np.log10(result[f"{name}slab_velocity"].values / REFERENCE)
            about = {"units": "dB", "long_name": "slab velocity level re 1e-6 mm/s"}
            result[f"{name}slab_level"] = "frequency", level, about
        progress(k + 1, len(tracks))
    if against is not None:
        loss = 20 * np.log10(result[f"{AGAINST}force"].values / result["force"].values)
        about = {"units": "dB", "long_name": "insertion loss, force on the foundation"}
        result["insertion_loss"] = "frequency", loss, about
    result.attrs = {"title": "force on the foundation, third octaves", "reference": "1e-6 mm/s"}
    return result


def _of_track(
    track: Track, acts: Excitation, frequency: FloatArray, position: str | float
) -> dict[str, tuple[ComplexArray, dict[str, str]]]:
    """By line, (n,), with units and words."""
    omega, loads = 2 * np.pi * frequency, acts.loads(track, position)
    forces = acts.forces(track, frequency, loads)

    def summed(of: ComplexArray) -> ComplexArray:
        total: ComplexArray = np.einsum("w...l,wl->w...", of, forces)
        return total

    length = shortest(track).cell_length
    cells = sorted({int(one.x // length) for one in loads})
    along = np.abs(summed(force_along(track, omega, loads, cells))) / length
    per = acts.per
    found = {
        "force": (
            summed(force_on_ground(track, omega, loads)),
            {"units": f"N{per}", "long_name": "force on the foundation"},
        ),
        "force_per_metre": (
            along.max(axis=1).astype(complex),
            {"units": f"N/m{per}", "long_name": "force on the foundation under a load, per metre"},
        ),
    }
    if track.slab.present:
        beside = Point(x=loads[-1].x, side=1, slab_y=0.0)
        moved = summed(infinite_receptance(track, omega, loads, [beside]))[:, 0]
        found["slab_velocity"] = (
            1j * omega * moved, {"units": f"m/s{per}", "long_name": "slab velocity"}
        )  # fmt: skip
    return found
