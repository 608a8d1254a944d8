"""What an FMU carries besides its interface: the models as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.track.reduced import ReducedTrack
from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import WHEELSETS, Multibody

Arrays = dict[str, NDArray[Any]]


def track_arrays(track: ReducedTrack) -> Arrays:
    """The reduced track; mode shapes as one table, (nodes, 2, modes): w and theta.

    The shapes are numbers of single precision, see `reduce_track`.
    """
    return {
        "poles": track.poles,
        "mu": track.mu,
        "partner": track.partner,
        "parity": track.parity,
        "table": np.stack([track.w, track.theta], axis=1).astype(np.complex64),
        "phi": np.array(track.phi),
        "residual_pole": np.array(track.residual_pole),
        "residual_compliance": track.residual_compliance,
        "cell_length": np.array(track.cell_length),
        "length": np.array(track.length),
    }


def vehicle_arrays(body: Multibody) -> Arrays:
    """The vehicle's modes, and how it rests on wheelsets held at given heights."""
    modal = modal_form(body)
    above = slice(0, WHEELSETS.start)
    # Bodies above follow the wheelsets at rest; columns: unit height of one wheelset.
    follow = np.zeros((body.K.shape[0], 4))
    follow[WHEELSETS] = np.eye(4)
    follow[above] = -np.linalg.solve(body.K[above, above], body.K[above, WHEELSETS])
    return {
        "poles": modal.poles,
        "rigid": modal.rigid,
        "modes": modal.modes,
        "left": modal.left,
        "inverse_mass": 1 / np.diag(body.M),
        "start_s": modal.state_of @ follow,
        "start_r": modal.rigid.T @ body.M @ follow,
        "wheel_load": np.array(body.wheel_load),
        "wheelset_x": body.wheelset_x,
    }
