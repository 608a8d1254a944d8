"""What the master asks of anything it couples: an FMU, a signal, or a fake in a test."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


class Hold(IntEnum):
    """How a component continues its inputs over a communication step.

    The numbers are the values of the FMU parameter `input_hold` of our own FMUs.
    """

    CONSTANT = 0
    """The value set before the step, held."""
    EXTRAPOLATE = 1
    """The line through the values set before this step and before the previous one."""
    INTERPOLATE = 2
    """The value set is that at the END of the step; the line to it from that of the step before,
    in the first step from the value at the end of initialisation."""


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One scalar of a component's interface.

    Attributes
    ----------
    name : str
        The FMI name, for instance ``wheelset[1].left.force_z``.
    unit : str
        FMI unit name; empty if the component states none.
    description : str
        What it is.
    nominal : float
        A typical magnitude, in `unit`; the yardstick for divergence.
    start : float
        What an input keeps when nothing is connected to it, in `unit`.
    """

    name: str
    unit: str = ""
    description: str = ""
    nominal: float = 1.0
    start: float = 0.0


class ComponentError(RuntimeError):
    """A component refused a call; the message names it, the time and what it said."""


class Component(Protocol):
    """A dynamic system that is stepped from outside.

    Vectors of inputs and outputs are in the order of `inputs` and `outputs`.
    """

    @property
    def name(self) -> str:
        """Name, unique in a system."""

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """The inputs."""

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """The outputs."""

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""

    @property
    def holds(self) -> frozenset[Hold]:
        """The ways this component can continue its inputs; CONSTANT is always among them."""

    @property
    def can_rollback(self) -> bool:
        """Whether `save_state` and `restore_state` work."""

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on; `hold` must be in `holds`."""

    def set_inputs(self, u: FloatArray) -> None:
        """Set all inputs, shape (n_inputs,)."""

    def get_outputs(self) -> FloatArray:
        """All outputs at the present time, for the inputs last set, shape (n_outputs,)."""

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). Raises ComponentError."""

    def save_state(self) -> Any:
        """Snapshot of everything that decides the future."""

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot, which stays usable."""
