"""Where a vehicle and a track are at rest together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import root

from railcosim.master.component import Component, FloatArray
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, RAIL, Layout

FIRST_COMPRESSION = 1e-4  # m, about the static one: where the search for equilibrium begins
STILL = 1e-6  # m/s2, and 0.1 N: a thousandth of what a bump of 1e-6 m does
SIZE = {"N": 1e5, "N.m": 1e4}
"""Of forces and moments, where they are looked for."""


def columns(system: System, names: Sequence[str]) -> list[int]:
    """Where outputs of these names, whoever's, stand in the system."""
    known = [name.partition(".")[2] for name in system.names]
    return [known.index(name) for name in names]


def settled(
    components: Sequence[Component],
    connections: Sequence[Connection],
    layout: Layout,
    vehicle: LoadedFmu,
    track: LoadedFmu,
) -> System:
    """Find the heights (and forces) for which vehicle and track are at rest together, as a system.

    The vehicle is at rest on wheelsets held at `start_z`; it needs no holding where the wheelsets'
    accelerations vanish. A track that is given forces sinks under them at once, in initialisation:
    the forces are then unknown, too, and cut from where they come; aside, too, for cones spread the
    rails. Wheelsets without `start_z` start as their maker wants.
    """
    able = [
        k
        for k, name in enumerate(layout.of_axles("start_z"))
        if name in vehicle.description.parameters
    ]
    starts, count = [layout.of_axles("start_z")[k] for k in able], len(able)
    known = {v.name: v for v in track.inputs}
    ports = [port for port in layout.ports if port.name(FORCE) in known]
    cut = [known[port.name(FORCE)] for port in ports]
    held = np.array([v.start for v in cut])
    size = np.array([SIZE[port.direction.force] for port in ports])
    pressing = Signal("forces at rest", cut, lambda t: held)
    into = {c.input: (c.source, c.output) for c in connections if c.target == track.name}
    whence = {into[v.name]: v.name for v in cut}
    wires = [
        replace(c, source=pressing.name, output=whence[c.source, c.output])
        if (c.source, c.output) in whence
        else c
        for c in connections
    ]
    system = System([*components, pressing], wires)
    system.begin(0.0)
    if not able:
        return system
    forces = [system.names.index(f"{source}.{output}") for source, output in whence]
    accelerations = columns(system, [layout.of_axles("az")[k] for k in able])

    def imbalance(unknown: FloatArray) -> FloatArray:
        """Heights (mm), forces (100 kN) to accelerations (m/s2) and what is wrong of the forces."""
        heights, held[:] = 1e-3 * unknown[:count], size * unknown[count:]
        vehicle.set_parameters(dict(zip(starts, heights.tolist(), strict=True)))
        system.begin(0.0)
        unequal = system.outputs[forces] - held
        return np.concatenate([system.outputs[accelerations], unequal / size])

    guess = np.full(count, 2.0)
    if cut:
        down = layout.down.names(RAIL.motion)
        rail = system.outputs[columns(system, [down[k] for k in able])]
        guess = np.concatenate([1e3 * (rail + FIRST_COMPRESSION), held / size])
    rest = imbalance(root(imbalance, guess, tol=1e-13).x)
    if not np.abs(rest).max() < STILL:
        raise CouplingError(
            "no static equilibrium of vehicle and track was found (largest remaining acceleration "
            f"{np.abs(rest[:count]).max():g} m/s2): check contact stiffness and wheel loads"
        )
    return system
