"""Components to a system, by the names of their variables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from railcosim.master.component import Component
from railcosim.master.connections import connect_by_name
from railcosim.master.system import System


def couple(components: Sequence[Component], required: Iterable[str] = ()) -> System:
    """A system in which every output feeds the inputs of its name.

    Parameters
    ----------
    components : sequence of Component
        With different names; FMUs, signals, laws.
    required : iterable of str, optional
        Inputs that must be connected; see `connect_by_name`.

    Raises
    ------
    CouplingError
        If an input has two sources, a unit differs from its source's, or a required input is left
        without one.
    """
    return System(components, connect_by_name(components, required))
