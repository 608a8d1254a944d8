"""How a vehicle's wheels roll: the law of its contacts from its parameters."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.creep import CreepLaw, LinearCreep
from railcosim.mechanics.contact.fastsim import Fastsim
from railcosim.mechanics.contact.geometry import Cone, Geometry
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.profiles import MOST_POINTS, Curve, ProfileError, tabulate
from railcosim.mechanics.contact.rolling import Flange, RollingContact
from railcosim.mechanics.contact.saturation import Saturated
from railcosim.parameters import ParameterError

from .on_rails import GRAVITY
from .parameters import Vehicle
from .properties import Contact, FileName, Rolling
from .train import Train, train_of

T = TypeVar("T")

CREEP: Mapping[str, Callable[[float], CreepLaw]] = {
    "linear": lambda friction: LinearCreep(),
    "saturated": lambda friction: Saturated(friction=friction),
    "fastsim": lambda friction: Fastsim(friction=friction),
}
"""Creep laws by the coefficient of friction."""
STEP = 1e-4  # m, of tabulated displacements: a twentieth of a patch
HEADER = ["y", "z"]
SIZE_LIMIT = 1_000_000  # bytes of a profile's file


def rolling_law(
    rolling: Rolling,
    contact: Contact,
    *,
    radius: float,
    side: FloatArray,
    speed: float,
    folder: Path | None = None,
) -> RollingContact:
    """The law of contacts of wheels of one radius.

    Parameters
    ----------
    rolling, contact : Rolling, Contact
        Of the vehicle.
    radius : float
        Of the wheels, m.
    side : array, shape (n,)
        LEFT or RIGHT of every contact.
    speed : float
        m/s, above 0.
    folder : Path, optional
        Where profiles are, or below, that no file names: those of one are beside it.

    Returns
    -------
    RollingContact
        With flanges as stops on cones; profiles have their own.

    Raises
    ------
    ParameterError
        If a name is none of those there are, or a profile cannot be used.
    """
    creep = _named(CREEP, "creep", rolling.creep)(rolling.friction)
    geometry = geometry_of(rolling, contact, radius=radius, folder=folder)
    flange = Flange(
        stiffness=rolling.flange_stiffness,
        clearance=rolling.flange_clearance,
        depth=rolling.flange_depth,
    )
    return RollingContact(
        geometry=geometry,
        side=side,
        speed=speed,
        creep=creep,
        flange=None if rolling.wheel_profile else flange,
    )


def geometry_of(
    rolling: Rolling, contact: Contact, *, radius: float, folder: Path | None = None
) -> Geometry:
    """Cones on round heads, or profiles, alike on both sides; see `rolling_law`."""
    modulus = contact.young_modulus / (2 * (1 + contact.poisson_ratio))
    cone = _named(GRAVITY, "gravity", rolling.gravity)
    if bool(rolling.wheel_profile) != bool(rolling.rail_profile):
        raise ParameterError("[rolling] wheel_profile and rail_profile: give both, or none")
    if not rolling.wheel_profile:
        return cone(
            radius=radius,
            half_distance=contact.half_distance,
            conicity=rolling.conicity,
            head_radius=contact.rail_radius,
            shear_modulus=modulus,
            poisson_ratio=contact.poisson_ratio,
        )
    if cone is not Cone:
        raise ParameterError("[rolling] gravity = 'textbook' is of cones: leave out the profiles")
    names = (rolling.wheel_profile, rolling.rail_profile)
    wheel, rail = (read_profile(_within(folder, name)) for name in names)
    steps = round(rolling.profile_range / STEP)
    try:
        table = tabulate(
            wheel,
            rail,
            np.linspace(-steps * STEP, steps * STEP, 2 * steps + 1),
            radius=radius,
            half_distance=contact.half_distance,
            shear_modulus=modulus,
            poisson_ratio=contact.poisson_ratio,
        )
    except ValueError as error:
        raise ParameterError(f"{' on '.join(names)}: {error}") from error
    return Profiled(
        reference_radius=radius,
        half_distance=contact.half_distance,
        left=table,
        right=table,
        shear_modulus=modulus,
    )


def profile_files(stock: Vehicle | Train) -> list[Path]:
    """Files of profiles that the vehicles' parameters name, those that are there."""
    names = [
        name
        for one in train_of(stock).vehicles
        for name in (one.vehicle.rolling.wheel_profile, one.vehicle.rolling.rail_profile)
        if name
    ]
    return [path for path in (_within(None, name) for name in names) if path.is_file()]


def read_profile(path: Path) -> Curve:
    """Read a profile of a right wheel or rail.

    Parameters
    ----------
    path : Path
        CSV: a line ``y,z``, then points in m, y outwards and growing, z down, both from the point
        at which the wheel's radius is measured, or from the rail's datum.

    Raises
    ------
    ParameterError
        One line with the file and what is wrong with it.
    """
    try:
        if not path.is_file() or path.stat().st_size > SIZE_LIMIT:
            raise ParameterError(f"{path}: must be a CSV file of at most {SIZE_LIMIT} bytes")
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [row for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ParameterError(f"{path}: cannot be read as CSV: {error}") from error
    if not rows or [cell.strip() for cell in rows[0]] != HEADER:
        raise ParameterError(f"{path}: the first line must be y,z; then points in m")
    if len(rows) - 1 > MOST_POINTS:
        raise ParameterError(f"{path}: {len(rows) - 1} points, at most {MOST_POINTS}")
    try:
        points = np.array([[float(y), float(z)] for y, z in rows[1:]]).reshape(-1, 2)
        return Curve(points[:, 0], points[:, 1])
    except ProfileError as error:
        raise ParameterError(f"{path}: {error}") from error
    except ValueError as error:
        raise ParameterError(f"{path}: every line must be two numbers, y and z: {error}") from error


def _within(folder: Path | None, name: str) -> Path:
    told = name.folder if isinstance(name, FileName) else folder
    home = (told or Path()).resolve()
    path = (home / name).resolve()
    if not path.is_relative_to(home):
        raise ParameterError(f"[rolling] {name!r}: must be in the vehicle file's folder, or below")
    return path


def _named(known: Mapping[str, T], key: str, name: str) -> T:
    if name not in known:
        raise ParameterError(f"[rolling] {key} = {name!r}: must be one of {', '.join(known)}")
    return known[name]
