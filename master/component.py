"""What the master asks of anything it couples: an FMU, a signal, a contact law, a linear model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from railcosim.master import plain
from railcosim.master.batch.call import Call, Span

FloatArray: TypeAlias = NDArray[np.float64]


class Hold(IntEnum):
    """How a component continues its inputs over a communication step by itself.

    The numbers are the values of the FMU parameter `input_hold` of our own FMUs.
    """

    CONSTANT = 0
    """The value set before the step, held."""
    EXTRAPOLATE = 1
    """The line through the values set before this step and before the previous one."""
    INTERPOLATE = 2
    """The value set is that at the END of the step; the line to it from that of the step before,
    in the first step from the value at the end of initialisation."""


class Type(Enum):
    """Types of values, as FMI calls them; all are exchanged as floating-point numbers."""

    REAL = "Real"
    INTEGER = "Integer"
    BOOLEAN = "Boolean"
    ENUMERATION = "Enumeration"

    @property
    def fits(self) -> frozenset[Type]:
        """The types of inputs that hold every value of an output of this type."""
        return _FITS[self]


_FITS = {
    Type.REAL: frozenset({Type.REAL}),
    Type.INTEGER: frozenset({Type.REAL, Type.INTEGER, Type.ENUMERATION}),
    Type.BOOLEAN: frozenset({Type.REAL, Type.INTEGER, Type.BOOLEAN}),
    Type.ENUMERATION: frozenset({Type.REAL, Type.INTEGER, Type.ENUMERATION}),
}


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
    has_nominal : bool
        Whether somebody has said so; else `nominal` is 1 for want of better.
    start : float
        What an input keeps when nothing is connected to it, in `unit`.
    type : Type
        Of its values. All but Real ones jump: they are held over a step.
    items : tuple of (str, int)
        Of an enumeration: its names, and their numbers.
    """

    name: str
    unit: str = ""
    description: str = ""
    nominal: float = 1.0
    has_nominal: bool = True
    start: float = 0.0
    type: Type = Type.REAL
    items: tuple[tuple[str, int], ...] = ()


class ComponentError(RuntimeError):
    """A component refused a call; the message names it, the time and what it said."""


class RunEnded(Exception):  # noqa: N818 (it is no error)
    """A component ends the run, as it may; says which, and when."""


class Prepared(NamedTuple):
    """Calls of a component that a system makes in every step; see the methods of these names."""

    write: Call
    read: Call
    step: Call


class Component(ABC):
    """A dynamic system that is stepped from outside.

    Values are exchanged through two arrays, `u` and `y`, which `bind` makes those of a system: so
    nothing is allocated or copied on the way.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    inputs, outputs : sequence of Variable
        The interface. All vectors of inputs and outputs are in this order.

    Attributes
    ----------
    name, inputs, outputs
        As given.
    u : array, shape (n_inputs,)
        Where `write_inputs` takes the inputs from.
    y : array, shape (n_outputs,)
        Where `read_outputs` puts the outputs.
    holds : frozenset of Hold
        The ways this component can continue its inputs by itself; CONSTANT is always among them.
    max_input_derivative : int
        Highest derivative of the inputs that `set_input_derivatives` takes; 0 if none.
    can_rollback : bool
        Whether `save_state` and `restore_state` work.
    takes_any_step : bool
        Whether steps may be of different lengths in a run.
    """

    holds: frozenset[Hold] = frozenset({Hold.CONSTANT})
    max_input_derivative: int = 0
    can_rollback: bool = False
    takes_any_step: bool = True

    def __init__(self, name: str, inputs: Sequence[Variable], outputs: Sequence[Variable]) -> None:
        self.name = name
        self.inputs = tuple(inputs)
        self.outputs = tuple(outputs)
        self.u: FloatArray = np.array([v.start for v in self.inputs], dtype=np.float64)
        self.y: FloatArray = np.zeros(len(self.outputs))

    def keep(self, values: Mapping[str, float]) -> None:
        """Let inputs, by name, keep other values than their start where nothing feeds them."""
        self.inputs = tuple(replace(v, start=values.get(v.name, v.start)) for v in self.inputs)
        self.u[:] = [values.get(v.name, x) for v, x in zip(self.inputs, self.u, strict=True)]

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        return np.ones((len(self.outputs), len(self.inputs)), dtype=bool)

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """Whether `feedthrough` is known of an output, and not only feared, shape (n_outputs,)."""
        return np.ones(len(self.outputs), dtype=bool)

    def bind(self, u: FloatArray, y: FloatArray) -> None:
        """Exchange values through these contiguous arrays from now on, shaped as `u` and `y`."""
        self.u, self.y = u, y

    def prepared(self, span: Span) -> Prepared:
        """`write_inputs`, `read_outputs`, `do_step` over `span`; of the arrays bound now."""

        def step() -> None:
            self.do_step(span.begin.value, span.length.value)

        return Prepared(Call(self.write_inputs), Call(self.read_outputs), Call(step))

    @abstractmethod
    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""

    @abstractmethod
    def read_outputs(self) -> None:
        """Put the outputs at the present time, for the inputs last written, into `y`."""

    @abstractmethod
    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). Raises ComponentError."""

    def foresee(self, times: FloatArray) -> None:  # noqa: B027 - most need it not
        """Be told for which times (s) one is likely to be asked next; nothing is promised.

        For what is cheaper done for many steps at once.
        """

    def through(self, t: float, ends: FloatArray) -> FloatArray:
        """Go from time `t` to one time after the other (s).

        Returns
        -------
        array, shape (n_ends, n_outputs)
            The outputs at each of them.
        """
        found = np.empty((len(ends), self.y.size))
        for shown, end in zip(found, ends.tolist(), strict=True):
            self.do_step(t, end - t)
            self.read_outputs()
            shown[...] = self.y
            t = end
        return found

    @property
    def jumping(self) -> NDArray[np.intp]:
        """The inputs that are no Reals: no polynomial goes through their values."""
        return np.flatnonzero([v.type is not Type.REAL for v in self.inputs])

    # --- for those who use a component by itself -----------------------------------------------

    def set_inputs(self, u: FloatArray) -> None:
        """Set all inputs, shape (n_inputs,)."""
        if len(u) != self.u.size:
            raise ValueError(f"{self.name}: {len(u)} values given for {self.u.size} inputs")
        self.u[:] = u
        self.write_inputs()

    def get_outputs(self) -> FloatArray:
        """All outputs, shape (n_outputs,); a copy."""
        self.read_outputs()
        return self.y.copy()

    def expect_step(self, step: float) -> None:  # noqa: B027 - most need it not
        """Be told how long (s) the steps of a run will be, or the longest of them."""

    # --- what not every component can ----------------------------------------------------------

    @property
    def texts_in(self) -> Mapping[str, str]:
        """Inputs that are texts or bytes, and their types; numbers are none of them."""
        return {}

    @property
    def texts_out(self) -> Mapping[str, str]:
        """Outputs likewise."""
        return {}

    def get_text(self, name: str) -> bytes:
        """What an output of `texts_out` is now."""
        raise ComponentError(f"{self.name}: has no text {name}")

    def set_text(self, name: str, text: bytes) -> None:
        """Make `text` the value of an input of `texts_in`."""
        raise ComponentError(f"{self.name}: takes no text {name}")

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on; `hold` must be in `holds`."""
        if hold not in self.holds:
            raise ComponentError(f"{self.name}: cannot {hold.name} its inputs")

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs at the beginning of the next step, for that step only.

        Parameters
        ----------
        derivatives : array, shape (order, n_inputs)
            The first, second ... derivative with respect to time, in units of the input per s,
            s2 ...; `order` up to `max_input_derivative`.
        """
        raise ComponentError(f"{self.name}: takes no derivatives of its inputs")

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs at the end of the last step per change of an input held over it.

        Returns
        -------
        array, shape (n_outputs, n_inputs), or None
            None if the component does not know; who wants it then makes the step again.
        """
        return None

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the end of the last step, per s.

        Returns
        -------
        array, shape (n_outputs,), or None
            None if the component does not know.
        """
        return None

    def keep_past(self) -> None:  # noqa: B027 - most keep nothing
        """Be told that steps may be taken back from now on, to a state before the present time.

        Until then only what is now is saved, and a run may begin with a state restored.
        """

    @property
    def rollback_fault(self) -> str | None:
        """Why `save_state` and `restore_state` do not work; None if they do."""
        return None if self.can_rollback else "it cannot save its state"

    def save_state(self) -> Any:
        """Snapshot of everything that decides the future."""
        raise ComponentError(f"{self.name}: cannot save its state")

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot, which stays usable."""
        raise ComponentError(f"{self.name}: cannot restore a state")

    def serialize_state(self, state: Any) -> bytes:
        """Write a snapshot as bytes, to be kept in a file; here one of plain values."""
        try:
            return plain.dumps(state)
        except TypeError as error:
            raise ComponentError(f"{self.name}: cannot write its state to a file") from error

    def deserialize_state(self, data: bytes) -> Any:
        """Read what `serialize_state` wrote, also in another process."""
        return plain.loads(data)
