"""A Model Exchange FMU at the point where it is linearised."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, TypeAlias

import numpy as np
from scipy.sparse import csc_array

from railcosim.master.component import FloatArray, Variable
from railcosim.master.fmi.archive import FmuError, unpack
from railcosim.master.fmi.calls import MODEL_EXCHANGE, Calls
from railcosim.master.fmi.description import FmuDescription, describe
from railcosim.master.fmi.flaws import read_raw
from railcosim.master.fmi.fmu_parameters import setting_of
from railcosim.master.fmi.kinds import KINDS, Passed
from railcosim.master.fmi.variables import Sizes, scalars_of
from railcosim.master.fmi.versions import CALLS
from railcosim.master.linear.state_space import IndexArray
from railcosim.master.suggest import suggest

OURS = "ours: railcosim export --model-exchange"
"""How FMUs of this package get what this needs."""

Values: TypeAlias = Mapping[str, float | int | bool]


@dataclass(frozen=True)
class Element:
    """A scalar variable, or one element of an array.

    Attributes
    ----------
    variable : Variable
        Name, unit, nominal value.
    owner : str
        Name of the whole variable.
    reference : int
        FMI value reference of it.
    element, size : int
        Which element of how many.
    """

    variable: Variable
    owner: str
    reference: int
    element: int
    size: int

    @property
    def name(self) -> str:
        """Of the scalar."""
        return self.variable.name


class _Group:
    """Elements, and the whole variables by which they are asked for."""

    def __init__(self, elements: Sequence[Element], function: str) -> None:
        self.elements = elements  # alive as long as its place among all is known by its address
        sizes = {e.reference: e.size for e in elements}
        ends = np.cumsum(list(sizes.values())).tolist() if sizes else []
        begins = dict(zip(sizes, [0, *ends], strict=False))
        total = ends[-1] if ends else 0
        self.where = np.array([begins[e.reference] + e.element for e in elements], dtype=np.intp)
        self.passed = Passed(
            function, ctypes.c_double, tuple(sizes), tuple(sizes.values()), 0, total
        )


class OperatingPoint:
    """A Model Exchange FMU in continuous time, where its initialisation has left it.

    Made by `load`. As a context manager it closes in any case.

    Attributes
    ----------
    description : FmuDescription
        Identity, interface, parameters.
    states, rates, inputs, outputs : list of Element
        Its continuous states, their derivatives, its continuous Real inputs and Real outputs.
    is_scalar : bool
        Whether none of them is an array, of whose elements it is not known what they depend on.
    values, magnitudes : ndarray, shape (n_states + n_inputs,)
        States, then inputs, at the point; and how large they are, or nominally.
    """

    def __init__(self, description: FmuDescription, raw: Any, sizes: Sizes, calls: Calls) -> None:
        self.description = description
        kinds = KINDS[description.fmi]
        (self._function,) = [k.function for k in kinds.values() if k.c_type is ctypes.c_double]

        def elements(variables: Iterable[Any]) -> list[Element]:
            found: list[Element] = []
            for v in variables:
                scalars = scalars_of(v, kinds[v.type], sizes)
                n = len(scalars)
                found += [Element(s, v.name, v.valueReference, k, n) for k, s in enumerate(scalars)]
            return found

        real = [
            v for v in raw.modelVariables
            if v.type in kinds and kinds[v.type].function == self._function and not v.alias
        ]  # fmt: skip
        rates = [unknown.variable for unknown in raw.derivatives]
        self.rates = elements(rates)
        self.states = elements(rate.derivative for rate in rates)
        # Others may only change at events; a linear model knows none.
        self.inputs = elements(
            v for v in real if v.causality == "input" and v.variability == "continuous"
        )
        self.outputs = elements(v for v in real if v.causality == "output")
        every = (*self.rates, *self.states, *self.inputs, *self.outputs)
        self.is_scalar = all(e.size == 1 for e in every)
        self.values, self.magnitudes = np.empty(0), np.empty(0)
        self._depends = {u.variable.name: u.dependencies for u in (*raw.derivatives, *raw.outputs)}
        self._groups: dict[int, _Group] = {}
        self._adjoints: dict[int, FloatArray] = {}  # of elements that a group keeps alive
        self._calls = calls

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
                raise FmuError(
                    f"{path}: no Model Exchange in it; export it with that ({OURS}), or linearise "
                    "it by pulses"
                )
            sizes = _sizes(describe(path, raw, raw.modelExchange), parameters)
            description = describe(path, raw, raw.modelExchange, sizes)
            calls = CALLS[description.fmi](raw.modelName, description, folder, MODEL_EXCHANGE)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        point = cls(description, raw, sizes, calls)
        try:
            point._initialise(at, parameters, time)
        except BaseException:
            point.close()
            raise
        return point

    def evaluate(self, unknowns: Sequence[Element], values: FloatArray) -> FloatArray:
        """Unknowns (rates, outputs) for these values of the states and inputs."""
        n = len(self.states)
        if n:
            self._calls.set_states(np.ascontiguousarray(values[:n]))
        self._set(self.inputs, values[n:])
        return self._get(unknowns)

    def derivative(
        self, unknowns: Sequence[Element], moved: IndexArray, seed: FloatArray
    ) -> FloatArray:
        """Change of the unknowns for a change of the states and inputs at the positions `moved`."""
        n = len(self.states)
        knowns = [self.states[k] if k < n else self.inputs[k - n] for k in moved.tolist()]
        of, by = self._group(unknowns), _Group(knowns, self._function)
        change, whole = np.zeros(of.passed.count), np.zeros(by.passed.count)
        whole[by.where] = seed
        self._calls.derivative(of.passed.references, by.passed.references, whole, change)
        return change[of.where]

    def adjoint_jacobian(self, unknowns: Sequence[Element]) -> FloatArray:
        """Derivatives by all states and inputs, an unknown a row, from adjoint derivatives."""
        if id(unknowns) in self._adjoints:
            return self._adjoints[id(unknowns)]
        of = self._group(unknowns)
        by = _Group([*self.states, *self.inputs], self._function)
        matrix = np.zeros((len(unknowns), len(by.elements)))
        for row, where in zip(matrix, of.where, strict=True):
            seed, change = np.zeros(of.passed.count), np.zeros(by.passed.count)
            seed[where] = 1.0
            self._calls.adjoint(of.passed.references, by.passed.references, seed, change)
            row[...] = change[by.where]
        self._adjoints[id(unknowns)] = matrix
        return matrix

    def dependencies(self, unknowns: Sequence[Element]) -> csc_array:
        """Which unknown may depend on which state or input, shape (n_unknowns, n_values)."""
        every = (*self.states, *self.inputs)
        knowns: dict[str, list[int]] = {}
        for k, known in enumerate(every):
            knowns.setdefault(known.owner, []).append(k)
        # FMI: a missing list means "may depend on everything".
        found = [
            range(len(every))
            if (declared := self._depends.get(unknown.owner)) is None
            else sorted({k for v in declared for k in knowns.get(v.name, ())})
            for unknown in unknowns
        ]
        rows = np.repeat(np.arange(len(found)), [len(columns) for columns in found])
        columns = np.array([k for columns in found for k in columns], dtype=np.intp)
        shape = (len(unknowns), len(every))
        return csc_array((np.ones(len(rows)), (rows, columns)), shape=shape)

    def close(self) -> None:
        """Free the instance and its folder. Harmless to repeat."""
        self._calls.free()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- initialisation ------------------------------------------------------------------------

    def _initialise(self, at: Values, parameters: Values, time: float) -> None:
        calls, path = self._calls, self.description.path
        calls.time = time
        settings = [
            setting_of(self.description, name, value, initialised=False)
            for name, value in parameters.items()
        ]
        if any(s.is_structural for s in settings):
            calls.resize([s for s in settings if s.is_structural])
        for setting in settings:
            if not setting.is_structural:
                calls.set_value(setting)
        calls.enter_initialization(time, None, None)
        inputs = {v.name: v for v in self.inputs}
        for name in at:
            if name not in inputs:
                raise FmuError(f"{path}: no continuous input {name}{suggest(name, inputs)}")
        self._set([inputs[name] for name in at], np.array(list(at.values()), dtype=float))
        calls.exit_initialization()
        calls.enter_continuous_time(time)
        n = len(self.states)
        x, nominal = np.zeros(n), np.ones(n)
        if n:
            calls.get_states(x, nominal)
        self.values = np.concatenate([x, self._get(self.inputs)])
        names = [v.name for v in self.outputs]
        self.standing = dict(zip(names, self._get(self.outputs).tolist(), strict=True))
        nominals = [*np.abs(nominal), *(e.variable.nominal for e in self.inputs)]
        size = np.maximum(np.abs(self.values), nominals)
        self.magnitudes = np.where(size > 0.0, size, 1.0)

    def _group(self, elements: Sequence[Element]) -> _Group:
        """By what whole variables elements are asked for."""
        group = self._groups.get(id(elements))
        if group is None:
            group = self._groups[id(elements)] = _Group(elements, self._function)
        return group

    def _set(self, elements: Sequence[Element], values: FloatArray) -> None:
        if len(elements):
            group = _Group(elements, self._function)
            whole = np.zeros(group.passed.count)
            if len(elements) < whole.size:  # the others stay as they are
                self._calls.exchange("Get", group.passed, whole)
            whole[group.where] = values
            self._calls.exchange("Set", group.passed, whole)

    def _get(self, elements: Sequence[Element]) -> FloatArray:
        group = self._group(elements)
        whole = np.zeros(group.passed.count)
        if whole.size:
            self._calls.exchange("Get", group.passed, whole)
        return whole[group.where]


def _sizes(description: FmuDescription, parameters: Values) -> Sizes:
    """Structural parameters that do not keep their defaults."""
    known = description.parameters
    return {k: int(v) for k, v in parameters.items() if k in known and known[k].is_structural}
