"""What every FMU that is loaded for Co-Simulation can do, wherever its code runs."""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Component, Hold, Type
from railcosim.master.fmi.description import FmuDescription, read_description
from railcosim.master.fmi.fmu_parameters import Scalar, setting_of


class FmuWarning(UserWarning):
    """What an FMU warned of in a run."""


class LoadedFmu(Component):
    """An FMU as a component: in this process (`FmuComponent`) or its own (`IsolatedComponent`).

    Parameters
    ----------
    name : str
        Name, unique in a system.
    description : FmuDescription
        What the FMU says of itself.
    folder : Path, optional
        Where it is unpacked; for structural parameters.

    Attributes
    ----------
    description
        As given; another one when structural parameters have been set.
    """

    def __init__(self, name: str, description: FmuDescription, folder: Path | None = None) -> None:
        super().__init__(name, description.inputs, description.outputs)
        self.description = description
        self._folder = folder
        self._sizes: dict[str, int] = {}
        self._told: tuple[float, float | None, float | None] = (0.0, None, None)
        self._step = description.default_step

    def expect_step(self, step: float) -> None:
        """Be told how long (s) steps will be, for the test of going back."""
        self._step = step

    def _resized(self, values: Mapping[str, Scalar]) -> FmuDescription:
        """The description with structural parameters that are among `values`; checks them."""
        known = self.description.parameters
        sizes = {
            name: int(setting_of(self.description, name, value, initialised=False).value)
            for name, value in values.items()
            if name in known and known[name].is_structural
        }
        if not sizes or self._folder is None:
            return self.description
        every = self._sizes | sizes
        description = read_description(self.description.path, self._folder, every)
        self._sizes = every
        return description

    def _reshape(self, description: FmuDescription) -> None:
        """Have the inputs and outputs of another description."""
        Component.__init__(self, self.name, description.inputs, description.outputs)
        self.description = description

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        return self.description.feedthrough

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """Whether the model structure lists the dependencies of an output."""
        return self.description.states_dependence

    @property
    def texts_in(self) -> Mapping[str, str]:
        """Inputs that are texts or bytes."""
        return {name: text.type for name, text in self.description.texts_in.items()}

    @property
    def texts_out(self) -> Mapping[str, str]:
        """Outputs that are texts or bytes."""
        return {name: text.type for name, text in self.description.texts_out.items()}

    @property
    def max_input_derivative(self) -> int:  # type: ignore[override]
        """2 if the FMU can interpolate its Real inputs (FMI names no order), else 0."""
        reals = any(v.type is Type.REAL for v in self.description.inputs)
        return 2 if reals and self.description.can_interpolate_inputs else 0

    @property
    def holds(self) -> frozenset[Hold]:  # type: ignore[override]
        """All holds if the FMU has the Integer parameter ``input_hold``, else only CONSTANT."""
        return (
            frozenset(Hold) if self.description.has_hold_parameter else frozenset({Hold.CONSTANT})
        )

    @property
    def takes_any_step(self) -> bool:  # type: ignore[override]
        """Whether it declares that steps may differ in length."""
        return self.description.takes_any_step

    @property
    def can_rollback(self) -> bool:  # type: ignore[override]
        """Whether going back to a saved state was tested, on another instance, and works."""
        return self.rollback_fault is None

    @property
    @abstractmethod
    def rollback_fault(self) -> str | None:
        """Why the FMU cannot go back to a saved state; None if it can."""

    @property
    @abstractmethod
    def warned(self) -> str:
        """What the FMU has warned of, once each, with a count; empty for nothing."""

    def tell_warnings(self) -> None:
        """Pass on what the FMU has warned of; when it is closed."""
        if self.warned:
            warnings.warn(f"{self.name} {self.warned}", FmuWarning, stacklevel=3)

    @property
    @abstractmethod
    def messages(self) -> tuple[str, ...]:
        """The last messages of the FMU, oldest first, as ``status: text``."""

    @abstractmethod
    def set_parameters(self, values: Mapping[str, Scalar]) -> None:
        """Set parameters.

        Parameters
        ----------
        values : mapping of str to float, int, bool or str
            By name; of an enumeration a number or a name, of bytes hexadecimals, of an array its
            elements (``gain[2]``). Fixed parameters only before `exit_initialization`, start values
            of other variables only before initialisation. Structural ones, before that, change the
            interface.

        Raises
        ------
        FmuError
            For an unknown name, a variable that is not a parameter, a value of the wrong type,
            or a fixed parameter after initialisation. Nothing is set then.
        """

    @abstractmethod
    def enter_initialization(
        self, start: float, stop: float | None = None, tolerance: float | None = None
    ) -> None:
        """Announce the time span and enter initialisation mode.

        Parameters
        ----------
        start, stop : float
            s. No step may end behind a stop that is told, not by a rounding; see `Pace.reach`.
        tolerance : float, optional
            Relative error that the FMU is asked to keep; that of its own default experiment if not
            given.

        Notes
        -----
        In it, `set_inputs` and `get_outputs` work: bring a coupled system to its initial state
        with `System.exchange` before `exit_initialization`.
        """

    @abstractmethod
    def exit_initialization(self) -> None:
        """Leave initialisation mode; steps may follow."""

    @abstractmethod
    def close(self) -> None:
        """Free the instance, its snapshots, its library and its folder. Harmless to repeat."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
