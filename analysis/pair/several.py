"""Several vehicle FMUs, one behind the other on one track, as one; wheelsets numbered through.

Nothing joins them but the track: a coupler acts within an FMU.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.linalg import block_diag

from railcosim.master import plain
from railcosim.master.component import FloatArray, Hold
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.fmi.variables import Parameter
from railcosim.mechanics.ports import wheelset_name, wheelset_of

from .contact import NUMBERS, fitting, told
from .numbering import (
    START_POSITION,
    Vehicles,
    check_order,
    files_of,
    layouts_of,
    renamed,
    through,
    vehicle_name,
)

Load: TypeAlias = Callable[..., LoadedFmu]
"""Loads an FMU from its path and, by keyword, a name."""


def load_vehicles(vehicle: Vehicles, load: Load) -> LoadedFmu:
    """Load the FMU of a vehicle, or those of several as one, named ``vehicle``."""
    files = files_of(vehicle)
    if len(files) == 1:
        return load(files[0], name="vehicle")
    loaded: list[LoadedFmu] = []
    try:
        for number, file in enumerate(files, start=1):
            loaded.append(load(file, name=vehicle_name(number)))
        return SeveralVehicles("vehicle", loaded)
    except BaseException:
        for fmu in loaded:
            fmu.close()
        raise


class SeveralVehicles(LoadedFmu):
    """Vehicles as one component, whose inputs and outputs are theirs, one after the other.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    fmus : sequence of LoadedFmu
        From the front. A parameter without a wheelset is that of all; ``vehicle[2].start_position``
        is of one.
    """

    def __init__(self, name: str, fmus: Sequence[LoadedFmu]) -> None:
        self.fmus = tuple(fmus)
        self._layouts = layouts_of([(f.description.path, [*f.inputs, *f.outputs]) for f in fmus])
        counts = [layout.wheelsets for layout in self._layouts]
        self._ahead = [0, *accumulate(counts)][:-1]
        self._u, self._y = (
            [slice(b - n, b) for n, b in zip(sizes, accumulate(sizes), strict=True)]
            for sizes in ([f.u.size for f in fmus], [f.y.size for f in fmus])
        )
        super().__init__(name, self._described())
        self.bind(self.u, self.y)

    def _described(self) -> FmuDescription:
        each = [fmu.description for fmu in self.fmus]
        numbered = list(enumerate(self._ahead, start=1))
        inputs, outputs = (
            tuple(v for of, at in zip(some, numbered, strict=True) for v in renamed(of, *at))
            for some in ([d.inputs for d in each], [d.outputs for d in each])
        )
        return replace(
            each[0],
            path=Path(", ".join(d.path.name for d in each)),
            sha256=" ".join(d.sha256 for d in each),
            model_name=", ".join(d.model_name for d in each),
            guid=" ".join(d.guid for d in each),
            inputs=inputs,
            outputs=outputs,
            passed_in=(),
            passed_out=(),
            clocks=(),
            texts_in={},
            texts_out={},
            feedthrough=block_diag(*(d.feedthrough for d in each)).astype(bool),
            states_dependence=np.concatenate([d.states_dependence for d in each]),
            parameters=self._parameters(),
            initials={},
            other_names={},
            can_get_and_set_state=all(d.can_get_and_set_state for d in each),
            can_serialize_state=all(d.can_serialize_state for d in each),
            takes_any_step=all(d.takes_any_step for d in each),
            can_interpolate_inputs=all(d.can_interpolate_inputs for d in each),
            has_directional_derivatives=all(d.has_directional_derivatives for d in each),
            has_adjoint_derivatives=False,
            has_output_rates=all(d.has_output_rates for d in each),
            default_tolerance=None,  # each has its own
            default_step=min(
                (d.default_step for d in each if d.default_step is not None), default=None
            ),
        )

    def _parameters(self) -> dict[str, Parameter]:
        """By their names among all; contact laws by wheelset, and of all if all are the same."""
        rows: dict[str, Parameter] = {}
        for number, (fmu, ahead) in enumerate(zip(self.fmus, self._ahead, strict=True), start=1):
            for name, row in fmu.description.parameters.items():
                own = name == START_POSITION or wheelset_of(name)
                rows.setdefault(through(name, number, ahead) if own else name, row)
        for name in NUMBERS:
            each = [row for at in range(len(self.fmus)) for row in self._contact_rows(at, name)]
            rows |= {row.name: row for row in each}
            alike = len({row.start for row in each}) == 1
            if not alike or len(each) < sum(layout.wheelsets for layout in self._layouts):
                rows.pop(name, None)
        return rows

    def _contact_rows(self, at: int, name: str) -> list[Parameter]:
        """What one of them tells of the contact of each of its wheelsets, if it does."""
        fmu, names = self.fmus[at], self._layouts[at].of_axles(name)
        known = told(fmu.description.parameters, name, names)
        if not known:
            return []
        row = fmu.description.parameters[next(iter(known))]
        numbers = np.resize(list(known.values()), len(names)).tolist()
        return [
            replace(row, name=through(own, at + 1, self._ahead[at]), start=repr(number))
            for own, number in zip(names, numbers, strict=True)
        ]

    def _own(self, name: str, at: int) -> str | None:
        """What one of them calls a parameter; None if that is another's."""
        found = wheelset_of(name)
        if found is not None:
            i = found[0] - self._ahead[at]
            return f"{wheelset_name(i)}.{found[1]}" if i in self._layouts[at].numbers else None
        starts = [through(START_POSITION, k + 1, 0) for k in range(len(self.fmus))]
        if name not in starts:
            return name
        return START_POSITION if starts.index(name) == at else None

    # --- life cycle ----------------------------------------------------------------------------

    def set_parameters(self, values: Mapping[str, Scalar]) -> None:
        """Set parameters, of the vehicles that have them; see `LoadedFmu`."""
        for name in values:
            if name not in self.description.parameters:
                raise FmuError(f"{self.description.path}: has no parameter {name}")
        for at, (fmu, layout) in enumerate(zip(self.fmus, self._layouts, strict=True)):
            own: dict[str | None, Any] = {self._own(k, at): v for k, v in values.items()}
            fmu.set_parameters(
                fitting({name: v for name, v in own.items() if name is not None}, fmu, layout)
            )

    def enter_initialization(
        self, start: float, stop: float | None = None, tolerance: float | None = None
    ) -> None:
        """See `LoadedFmu`; CouplingError if they do not stand one behind the other."""
        places = []
        for fmu, layout in zip(self.fmus, self._layouts, strict=True):
            fmu.enter_initialization(start, stop, tolerance)
            values = dict(zip((v.name for v in fmu.outputs), fmu.get_outputs(), strict=True))
            names = layout.of_axles("position")
            if values.keys() >= set(names):
                places.append(np.array([values[name] for name in names]))
        if len(places) == len(self.fmus):
            check_order([fmu.description.path for fmu in self.fmus], places)

    def exit_initialization(self) -> None:
        """See `LoadedFmu`."""
        for fmu in self.fmus:
            fmu.exit_initialization()

    def close(self) -> None:
        """See `LoadedFmu`."""
        for fmu in self.fmus:
            fmu.close()

    def expect_step(self, step: float) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.expect_step(step)

    @property
    def warned(self) -> str:
        """Nothing: each says what it has warned of."""
        return ""

    @property
    def messages(self) -> tuple[str, ...]:
        """Of all; see `LoadedFmu`."""
        return tuple(f"{fmu.name}: {text}" for fmu in self.fmus for text in fmu.messages)

    @property
    def holds(self) -> frozenset[Hold]:  # type: ignore[override]
        """Those of all."""
        return frozenset.intersection(*(fmu.holds for fmu in self.fmus))

    # --- stepping ------------------------------------------------------------------------------

    def bind(self, u: FloatArray, y: FloatArray) -> None:
        """Exchange values through these arrays, of which each has its part."""
        super().bind(u, y)
        for fmu, given, told_ in zip(self.fmus, self._u, self._y, strict=True):
            fmu.bind(u[given], y[told_])

    def write_inputs(self) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.write_inputs()

    def read_outputs(self) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.read_outputs()

    def do_step(self, t: float, h: float) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.do_step(t, h)

    def set_hold(self, hold: Hold) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.set_hold(hold)

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """See `Component`."""
        for fmu, given in zip(self.fmus, self._u, strict=True):
            fmu.set_input_derivatives(derivatives[:, given])

    def step_derivative(self) -> FloatArray | None:
        """See `Component`."""
        found = [fmu.step_derivative() for fmu in self.fmus]
        known = [part for part in found if part is not None]
        return None if len(known) < len(found) else block_diag(*known)

    def output_rates(self) -> FloatArray | None:
        """See `Component`."""
        found = [fmu.output_rates() for fmu in self.fmus]
        known = [part for part in found if part is not None]
        return None if len(known) < len(found) else np.concatenate(known)

    # --- state ---------------------------------------------------------------------------------

    @property
    def rollback_fault(self) -> str | None:
        """That of the first that has one."""
        return next((f.rollback_fault for f in self.fmus if f.rollback_fault is not None), None)

    def keep_past(self) -> None:
        """See `Component`."""
        for fmu in self.fmus:
            fmu.keep_past()

    def save_state(self) -> tuple[Any, ...]:
        """See `Component`."""
        return tuple(fmu.save_state() for fmu in self.fmus)

    def restore_state(self, state: tuple[Any, ...]) -> None:
        """See `Component`."""
        for fmu, own in zip(self.fmus, state, strict=True):
            fmu.restore_state(own)

    def serialize_state(self, state: tuple[Any, ...]) -> bytes:
        """See `Component`."""
        own = zip(self.fmus, state, strict=True)
        return plain.dumps(tuple(fmu.serialize_state(one) for fmu, one in own))

    def deserialize_state(self, data: bytes) -> tuple[Any, ...]:
        """See `Component`."""
        parts = plain.loads(data)
        return tuple(fmu.deserialize_state(p) for fmu, p in zip(self.fmus, parts, strict=True))
