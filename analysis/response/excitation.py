"""What excites a coupled vehicle and track: forces, and irregularity that wheels meet."""

from __future__ import annotations

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import Response, lag
from railcosim.mechanics.ports import DIRECTIONS, IRREGULARITY, MOST_WHEELSETS, Layout, Port, Y
from railcosim.track.irregularity.quantities import QUANTITIES, Quantity

WHEELSET_FORCE, RAIL_FORCE = "force_z", "rail_force_"
FORCES = (WHEELSET_FORCE, *(f"{RAIL_FORCE}{direction}" for direction in "zy"))
IRREGULARITIES: dict[str, Quantity] = {"irregularity_z": QUANTITIES["vertical"], **QUANTITIES}
"""By names of excitations: the vertical one by the name of the variables, too."""

VERTICAL = {WHEELSET_FORCE, f"{RAIL_FORCE}z", "irregularity_z", "vertical"}
"""Those that the vertical model knows."""


def check_excitation(
    excitation: str, wheelsets: int = MOST_WHEELSETS, *, in_space: bool = True
) -> None:
    """Raise CouplingError if nothing on so many wheelsets is excited so; see `loads_of`."""
    axles = Layout(wheelsets).axles
    axle, _, what = excitation.rpartition(".")
    wide, forces = (
        [name for name in names if in_space or name in VERTICAL]
        for names in (IRREGULARITIES, FORCES)
    )
    known = {*wide, *forces} if axle else set(wide)
    if what not in known or (axle and axle not in axles):
        more = "" if in_space else "; vehicle and track in space know more (--dimension spatial)"
        raise CouplingError(
            f"excitation {excitation}: must be {', '.join(wide)}, or one of {axles[0]} "
            f"to {axles[-1]} with .{', .'.join((*forces, *wide))}{more}"
        )


def check_irregularity(name: str, *, in_space: bool) -> None:
    """Raise CouplingError if it is nothing that all wheels meet, one after the other."""
    known = [one for one in IRREGULARITIES if in_space or one in VERTICAL]
    if name not in known:
        more = "" if in_space else "; vehicle and track in space know more (--dimension spatial)"
        raise CouplingError(f"irregularity {name}: must be one of {', '.join(known)}{more}")


def is_irregularity(excitation: str) -> bool:
    """Whether an excitation is in m, not in N."""
    return excitation.rpartition(".")[2] in IRREGULARITIES


def is_mirrored(excitation: str) -> bool:
    """Whether an excitation is its own mirror image, so that nothing goes aside or rolls."""
    what = excitation.rpartition(".")[2]
    if what not in IRREGULARITIES:
        return what != f"{RAIL_FORCE}y"
    quantity = IRREGULARITIES[what]
    sign = {d.name: d.mirror for d in DIRECTIONS}[quantity.direction]
    return quantity.left == sign * quantity.right


def loads_of(
    system: Response, excitation: str, positions: FloatArray, speed: float
) -> tuple[list[str], ComplexArray]:
    """Inputs of a coupled response that are excited, and how much, (n_omega, n_inputs).

    Parameters
    ----------
    system, excitation, positions, speed
        See `railcosim.analysis.response.frequency.response`.

    Raises
    ------
    CouplingError
        If there is no such excitation, or the system does not know of it.
    """
    layout = Layout(len(positions))
    aside = tuple(f".{what}" for what in (Y.effort, IRREGULARITY.format(Y.name)))
    in_space = any(name.endswith(aside) for name in system.inputs)
    check_excitation(excitation, layout.wheelsets, in_space=in_space)
    axle, _, what = excitation.rpartition(".")
    wheels = [port for port in layout.ports if not axle or port.wheel.startswith(f"{axle}.")]
    if what in IRREGULARITIES:
        quantity = IRREGULARITIES[what]
        wanted = {_gap(port, quantity): getattr(quantity, port.side) for port in wheels}
    elif what == WHEELSET_FORCE:
        # Contact forces lift the vehicle's wheels; half of a force down goes to each.
        wanted = {f"vehicle.{port.wheel}.force_z": -0.5 for port in wheels}
    else:
        along = what.removeprefix(RAIL_FORCE)
        wanted = {f"track.{port.wheel}.force_{along}": 1.0 for port in wheels}
    if not set(wanted) <= set(system.inputs):
        raise CouplingError(f"excitation {excitation}: there is no such input in {system.name}")
    delays = [
        0.0 if axle else (positions.max() - positions[port.wheelset - 1]) / speed for port in wheels
    ]
    amplitudes = np.array(list(wanted.values())) * lag(system.omega, delays)
    return list(wanted), amplitudes


def _gap(port: Port, quantity: Quantity) -> str:
    return f"{port.wheel}.{IRREGULARITY.format(quantity.direction)}"
