"""What joins two components: springs, or any linear law of their motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray


@dataclass(frozen=True, kw_only=True)
class End:
    """A joint's end at one of two components.

    Attributes
    ----------
    inputs : tuple of str, length n_inputs
        Of the component, each with one of the joint's forces on it.
    takes : tuple of int, length n_inputs
        Which of the forces each is.
    outputs : tuple of str, length n_outputs
        Motions of the component that the joint feels.
    stiffness, damping : array, shape (n_forces, n_outputs)
        What these motions and their rates do to the joint's forces; no damping if None.
    beside : array, shape (n_forces, n_outputs), or None
        What their rates do at the same inputs, but for the forces that are told as the joint's.
    """

    inputs: tuple[str, ...]
    takes: tuple[int, ...]
    outputs: tuple[str, ...]
    stiffness: FloatArray
    damping: FloatArray | None = None
    beside: FloatArray | None = None


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A linear law between two components, or between one and the ground.

    Its forces f follow from ``flexibility f = stiffness y + damping dy/dt + by_gap gap``, with the
    motions y of both ends. Each force is the same number at the inputs of both components; their
    own signs make it a push on one and a counter-push on the other.

    Attributes
    ----------
    forces, gaps : tuple of str
        Names of forces and irregularities in the coupled response.
    first, second : End
        At the two components; the second is unused if there is none.
    flexibility : array, shape (n_forces, n_forces)
        See above: 1 where the ends have stiffnesses, and that of a spring where they have ones.
    by_gap : array, shape (n_forces, n_gaps)
        See above.
    """

    forces: tuple[str, ...]
    gaps: tuple[str, ...]
    first: End
    second: End
    flexibility: FloatArray
    by_gap: FloatArray


ONE = np.ones((1, 1))


def spring(
    force: str, gap: str, *, first: tuple[str, str], second: tuple[str, str], stiffness: float
) -> Joint:
    """A spring, of force ``stiffness * (first output - second output - gap)``.

    Parameters
    ----------
    force, gap : str
        What the coupled response calls its force and its irregularity.
    first, second : tuple of str
        Input for the force, and output, of each component.
    stiffness : float
        In N/m, positive; infinite for a rigid joint.

    Raises
    ------
    ValueError
        If the stiffness is not positive.
    """
    if not stiffness > 0.0:
        raise ValueError(f"joint {force}: stiffness is {stiffness}, must be positive")
    ends = (
        End(inputs=(push,), takes=(0,), outputs=(motion,), stiffness=sign * ONE)
        for (push, motion), sign in ((first, 1.0), (second, -1.0))
    )
    one, other = ends
    return Joint(
        forces=(force,), gaps=(gap,), first=one, second=other,
        flexibility=ONE / stiffness, by_gap=-ONE,
    )  # fmt: skip
