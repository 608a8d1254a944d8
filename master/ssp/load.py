"""From an SSP file to components and connections that can be run."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from railcosim.master.fmi.archive import MAX_TOTAL_SIZE, FmuError, unpack_archive, unpacked_size
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law_file import read_law
from railcosim.master.ssp.assemble import LoadedSystem, assemble
from railcosim.master.ssp.package import Package, check_structure
from railcosim.master.ssp.read import read_structure
from railcosim.master.ssp.structure import MAIN, Structure
from railcosim.master.system import System

_EXCHANGES = 100
"""Enough for 16 digits where each exchange leaves two thirds of the error."""


@contextmanager
def open_ssp(
    path: str | Path,
    *,
    load: Callable[..., LoadedFmu] = FmuComponent.load,
    variant: str | None = None,
    law: str | Path | None = None,
) -> Iterator[LoadedSystem]:
    """Load a system from an SSP 1.0 or 2.0 file for as long as the block lasts.

    Systems in systems are made flat: a component is called after all that it is in, but the
    outermost.

    Parameters
    ----------
    path : str or Path
        The ``.ssp`` file. The code in it is run: load only what you would run.
    load : callable, optional
        Makes an FMU from a file and, by keyword, a name.
    variant : str, optional
        Which of several system structures in the file, by its name; SystemStructure.ssd if not
        given.
    law : str or Path, optional
        Springs and dampers in the master, see `railcosim.master.law_file`.

    Yields
    ------
    LoadedSystem
        To be made a `System`, and initialised by `initialise`.

    Raises
    ------
    CouplingError
        If the law is wrong.
    FmuError
        If the file is refused (see `unpack_archive`), is wrong, or asks for what is not supported.

    References
    ----------
    .. [1] Modelica Association, System Structure and Parameterization 1.0, 2019.
    """
    path = Path(path)
    with ExitStack() as stack:
        folder = unpack_archive(path, MAIN, check_structure)
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        try:
            package = Package(path, folder)
            if variant is not None:
                package = package.of_variant(variant)
            structure = read_structure(package)
            _check_size(path, structure)
            fmus = {
                name: stack.enter_context(load(file, name=name))
                for name, file in structure.fmus.items()
            }
            loaded = assemble(path, structure, fmus)
        except FmuError as error:  # people know the package, not where it was unpacked
            raise FmuError(str(error).replace(str(folder), str(path))) from error
        yield loaded if law is None else loaded.joined_by(*read_law(Path(law), loaded.components))


def initialise(
    system: System,
    fmus: Sequence[LoadedFmu],
    start: float,
    stop: float | None = None,
    tolerance: float | None = None,
) -> bool:
    """Initialise FMUs together, each with the values of the others.

    Parameters
    ----------
    system : System
        What they are connected to.
    fmus : sequence of LoadedFmu
        Instantiated, parameters set.
    start, stop : float
        s; see `LoadedFmu.enter_initialization`.
    tolerance : float, optional
        Likewise.

    Returns
    -------
    bool
        Whether the values settled to the last bit.
    """
    for fmu in fmus:
        fmu.enter_initialization(start, stop, tolerance)
    settled = False
    # What an output depends on in initialisation is not what it depends on later, by which an
    # exchange is sorted: x(0) = u makes x an output with feedthrough, once.
    # A chain of components needs an exchange each; a circle settles if its gain is well below 1.
    for _ in range(len(system.components) + _EXCHANGES):
        before = system.outputs.copy()
        system.begin(start)
        settled = np.array_equal(before, system.outputs, equal_nan=True)
        if settled:
            break
    for fmu in fmus:
        fmu.exit_initialization()
    return settled


def _check_size(path: Path, structure: Structure) -> None:
    """Every component is unpacked for itself, however often a file is used."""
    total = sum(unpacked_size(file) for file in structure.fmus.values())
    if total > MAX_TOTAL_SIZE:
        raise FmuError(
            f"{path}: its {len(structure.fmus)} FMUs have {total / 1e6:.0f} MB unpacked; refused, "
            f"the limit is {MAX_TOTAL_SIZE / 1e6:.0f} MB"
        )
