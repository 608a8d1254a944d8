"""What each part of the coupling changes: the coupled response against four simpler ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError

from .estimate import third_octaves
from .frequency import apart, coupled, on_rigid_track, response
from .models import Models
from .resonance import resonance

VEHICLE = {
    "car body": "vehicle.carbody.z",
    "front bogie": "vehicle.bogie[1].z",
    "wheelset 1": "vehicle.wheelset[1].left.wheel_z",
    "contact force 1": "wheelset[1].left.force_z",
}
RAIL = {"rail under wheelset 1": "track.wheelset[1].left.rail_z"}
HIGHEST = 200.0  # Hz; above, what is largest is one of many waves between wheels and fastenings
NEGLIGIBLE = 0.5  # dB: six per cent, what suspensions and pads scatter by from one to the next


@dataclass(frozen=True, kw_only=True)
class Change:
    """One output with and without one part of the coupling.

    Attributes
    ----------
    part, output : str
        What is missing; what responds.
    unit : str
        Of the response.
    with_part, without_part : array, shape (n_frequency,)
        Magnitudes.
    resonance_with, resonance_without : float
        Where they are largest below `HIGHEST`, Hz.
    centres, decibel : array, shape (n_bands,)
        Change of the mean square in third octaves, without over with, dB.
    """

    part: str
    output: str
    unit: str
    with_part: FloatArray
    without_part: FloatArray
    resonance_with: float
    resonance_without: float
    centres: FloatArray
    decibel: FloatArray

    @property
    def neglected_in(self) -> list[tuple[float, float]]:
        """Ranges (Hz) of third octaves in which the part makes less than `NEGLIGIBLE`."""
        small = np.concatenate([[False], np.abs(self.decibel) < NEGLIGIBLE, [False]])
        edges = np.flatnonzero(np.diff(small.astype(int)))
        half = 10**0.05
        return [
            (float(self.centres[a] / half), float(self.centres[b - 1] * half))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]

    def where_negligible(self) -> str:
        """The same in words."""
        ranges = [f"{low:.3g}-{high:.3g} Hz" for low, high in self.neglected_in]
        return ", ".join(ranges) or "nowhere"


def changes(models: Models, frequency: FloatArray, k_H: float, speed: float) -> list[Change]:
    """Leave out one part of the coupling after the other.

    Parameters
    ----------
    models : Models
        Vehicle and track.
    frequency : array, shape (n,)
        Hz.
    k_H : float
        Contact stiffness, N/m.
    speed : float
        m/s, for the lag of the wheels.

    Returns
    -------
    list of Change
        Rigid track, no phase lag and rigid contact under unit irregularity; no vehicle under a unit
        force on each rail.
    """
    known = {v.name for v in models.vehicle.outputs}
    if len(models.positions) != 4 or not known.issuperset({"carbody.z", "bogie[1].z"}):
        raise CouplingError(
            "parts of the coupling are told of one car body on two bogies of two wheelsets each; "
            f"this vehicle has {len(models.positions)} wheelsets, or other bodies"
        )
    omega = 2 * np.pi * frequency
    full = coupled(models, omega, k_H)
    at_once = 1e9 * speed  # so fast that all wheels meet the irregularity together
    found = []
    for part, system, v, outputs in (
        ("flexible track", on_rigid_track(models, omega, k_H), speed, VEHICLE),
        ("phase lag", full, at_once, VEHICLE | RAIL),
        ("contact flexibility", coupled(models, omega, np.inf), speed, VEHICLE | RAIL),
        ("vehicle", apart(models, omega), speed, RAIL),
    ):
        excitation = "wheelset[1].rail_force_z" if part == "vehicle" else "irregularity_z"
        per = "N" if part == "vehicle" else "m"
        values = response(full, excitation, models.positions, speed)
        other = response(system, excitation, models.positions, v)
        for name, output in outputs.items():
            pair = (
                np.abs(values[:, full.rows([output])[0]]),
                np.abs(other[:, system.rows([output])[0]]),
            )
            unit = f"{'N' if output.endswith('force_z') else 'm'}/{per}"
            found.append(_change(part, name, unit, frequency, *pair))
    return found


def _change(
    part: str, output: str, unit: str, frequency: FloatArray, full: FloatArray, less: FloatArray
) -> Change:
    centres, power = third_octaves(frequency, full**2)
    _, other = third_octaves(frequency, less**2)
    low = frequency <= max(HIGHEST, frequency[0])
    return Change(
        part=part, output=output, unit=unit, with_part=full, without_part=less,
        resonance_with=resonance(frequency[low], full[low]),
        resonance_without=resonance(frequency[low], less[low]),
        centres=centres, decibel=10 * np.log10(other / power),
    )  # fmt: skip
