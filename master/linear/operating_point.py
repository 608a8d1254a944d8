"""An FMI 2.0 Model Exchange FMU at the point where it is linearised."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self, TypeAlias

import fmpy.fmi2
import numpy as np
from scipy.sparse import csc_array

from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.fmi.archive import FmuError, unpack
from railcosim.master.fmi.description import FmuDescription, coupling_variable, describe
from railcosim.master.fmi.flaws import read_raw
from railcosim.master.fmi.fmu_instance import MODEL_EXCHANGE, FmuInstance
from railcosim.master.fmi.fmu_parameters import parameter_call
from railcosim.master.linear.state_space import IndexArray
from railcosim.master.suggest import suggest

EVENT_ITERATIONS = 100
"""How often an FMU may ask for another event iteration before it counts as stuck."""

Values: TypeAlias = Mapping[str, float | int | bool]


class OperatingPoint:
    """A Model Exchange FMU in continuous time, where its initialisation has left it.

    Made by `load`. As a context manager it closes in any case. Its variables are as FMPy
    describes them.

    Attributes
    ----------
    description : FmuDescription
        Identity, interface, parameters.
    states, rates, inputs, outputs : list
        Its continuous states, their derivatives, its continuous Real inputs and Real outputs.
    values, magnitudes : ndarray, shape (n_states + n_inputs,)
        States, then inputs, at the point; and how large they are, or nominally.
    """

    def __init__(self, description: FmuDescription, raw: Any, instance: FmuInstance) -> None:
        self.description = description
        self.rates = [unknown.variable for unknown in raw.derivatives]
        self.states = [rate.derivative for rate in self.rates]
        real = [v for v in raw.modelVariables if v.type == "Real"]
        # Others may only change at events; a linear model knows none.
        self.inputs = [v for v in real if v.causality == "input" and v.variability == "continuous"]
        self.outputs = [v for v in real if v.causality == "output"]
        self.values, self.magnitudes = np.empty(0), np.empty(0)
        self._depends = {u.variable.name: u.dependencies for u in (*raw.derivatives, *raw.outputs)}
        self._instance = instance

    @classmethod
    def load(cls, path: Path, *, at: Values, parameters: Values, time: float) -> Self:
        """Unpack, instantiate and initialise an FMU.

        Parameters
        ----------
        path : Path
            The ``.fmu`` file. Its code is run: load only what you would run.
        at : mapping of str to float
            Inputs that do not keep their start values.
        parameters : mapping of str to float, int or bool
            Parameters that do not keep their defaults.
        time : float
            In s.

        Raises
        ------
        FmuError
            If the file is not a usable Model Exchange FMU, or a name or value is wrong.
        ComponentError
            If the FMU refuses a call.
        """
        folder = unpack(path)
        try:
            raw = read_raw(path, folder)
            if raw.modelExchange is None:
                raise FmuError(f"{path}: no Model Exchange in it; linearise it by pulses")
            description = describe(path, raw, raw.modelExchange)
            instance = FmuInstance(raw.modelName, description, folder, MODEL_EXCHANGE)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        point = cls(description, raw, instance)
        try:
            point._initialise(at, parameters, time)
        except BaseException:
            point.close()
            raise
        return point

    def evaluate(self, unknowns: Sequence[Any], values: FloatArray) -> FloatArray:
        """Unknowns (rates, outputs) for these values of the states and inputs."""
        n = len(self.states)
        if n:
            self._instance.call("fmi2SetContinuousStates", _pointer(values), n)
        self._set(self.inputs, values[n:])
        return self._get(unknowns)

    def derivative(
        self, unknowns: Sequence[Any], moved: IndexArray, seed: FloatArray
    ) -> FloatArray:
        """Change of the unknowns for a change of the states and inputs at the positions `moved`."""
        n = len(self.states)
        knowns = [self.states[k] if k < n else self.inputs[k - n] for k in moved.tolist()]
        change = np.zeros(len(unknowns))
        self._instance.call(
            "fmi2GetDirectionalDerivative",
            _references(unknowns),
            len(unknowns),
            _references(knowns),
            len(knowns),
            _pointer(seed),
            _pointer(change),
        )
        return change

    def dependencies(self, unknowns: Sequence[Any]) -> csc_array:
        """Which unknown may depend on which state or input, shape (n_unknowns, n_values)."""
        knowns = {v.name: k for k, v in enumerate((*self.states, *self.inputs))}
        # FMI: a missing list means "may depend on everything".
        found = [
            knowns.values()
            if (declared := self._depends.get(unknown.name)) is None
            else sorted({knowns[v.name] for v in declared if v.name in knowns})
            for unknown in unknowns
        ]
        rows = np.repeat(np.arange(len(found)), [len(columns) for columns in found])
        columns = np.array([k for columns in found for k in columns], dtype=np.intp)
        shape = (len(unknowns), len(knowns))
        return csc_array((np.ones(len(rows)), (rows, columns)), shape=shape)

    def close(self) -> None:
        """Free the instance and its folder. Harmless to repeat."""
        self._instance.free()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- initialisation ------------------------------------------------------------------------

    def _initialise(self, at: Values, parameters: Values, time: float) -> None:
        call, path = self._instance.call, self.description.path
        self._instance.time = time
        for name, value in parameters.items():
            function, *arguments = parameter_call(self.description, name, value, initialised=False)
            call(function, arguments[0], 1, arguments[1])
        call("fmi2SetupExperiment", False, 0.0, time, False, 0.0)
        call("fmi2EnterInitializationMode")
        inputs = {v.name: v for v in self.inputs}
        for name in at:
            if name not in inputs:
                raise FmuError(f"{path}: no continuous input {name}{suggest(name, inputs)}")
        self._set([inputs[name] for name in at], np.array(list(at.values()), dtype=float))
        call("fmi2ExitInitializationMode")
        self._settle(time)
        call("fmi2EnterContinuousTimeMode")
        n = len(self.states)
        x, nominal = np.zeros(n), np.ones(n)
        if n:
            call("fmi2GetContinuousStates", _pointer(x), n)
            call("fmi2GetNominalsOfContinuousStates", _pointer(nominal), n)
        self.values = np.concatenate([x, self._get(self.inputs)])
        names = [v.name for v in self.outputs]
        self.standing = dict(zip(names, self._get(self.outputs).tolist(), strict=True))
        nominals = [*np.abs(nominal), *(coupling_variable(v).nominal for v in self.inputs)]
        size = np.maximum(np.abs(self.values), nominals)
        self.magnitudes = np.where(size > 0.0, size, 1.0)

    def _settle(self, time: float) -> None:
        """Let the events at the beginning pass."""
        info = fmpy.fmi2.fmi2EventInfo()
        for _ in range(EVENT_ITERATIONS):
            self._instance.call("fmi2NewDiscreteStates", ctypes.byref(info))
            if info.terminateSimulation:
                raise ComponentError(f"{self.description.path}: ends at once, at t = {time:g} s")
            if not info.newDiscreteStatesNeeded:
                return
        raise ComponentError(
            f"{self.description.path}: its events at t = {time:g} s do not end "
            f"({EVENT_ITERATIONS} iterations)"
        )

    def _set(self, variables: Sequence[Any], values: FloatArray) -> None:
        if len(variables):
            kept = np.ascontiguousarray(values)
            references = _references(variables)
            self._instance.call("fmi2SetReal", references, len(variables), _pointer(kept))

    def _get(self, variables: Sequence[Any]) -> FloatArray:
        values = np.zeros(len(variables))
        if len(variables):
            references = _references(variables)
            self._instance.call("fmi2GetReal", references, len(variables), _pointer(values))
        return values


def _pointer(array: FloatArray) -> Any:
    """Make a C pointer to the array's data; the array must outlive the call."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def _references(variables: Sequence[Any]) -> Any:
    """Make a ctypes array of value references."""
    return (ctypes.c_uint * len(variables))(*(v.valueReference for v in variables))
