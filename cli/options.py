"""What is given to options that commands share: how it is checked and read."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import typer

from railcosim.parameters import UnusualWarning, Usual

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .parameter_options import FmuOptions

    FloatArray = NDArray[np.float64]

MAX_FREQUENCIES = 1_000_000
LIMITS = {  # wider than anything that is built: what is outside is a slip, or overflows
    "--amplitude": (1e-100, 1e100),
    "--frequencies": (
        1e-3,
        1e6,
    ),  # below, 1 / omega^2 of a free vehicle takes the digits: 1e-7 left
    "--length": (1.0, 1e6),
    "--shortest": (1e-3, 1e3),
    "--speed": (1e-3, 1e4),
    "--speeds": (1e-3, 1e4),
    "--step": (1e-12, 1e9),
    "--steps": (1e-12, 1e9),
    "--time": (1e-9, 1e9),
    "--wavelengths": (1e-3, 1e6),
}
OR_HERTZ = ", hertz, or hertz:N/m"
STIFFEST, SOFTEST = 1e15, 1e3  # N/m; softer, a wheel would hang metres below its place


class UsageError(ValueError):
    """The command line asks for something that cannot be; exit status 2."""


_SPEED = Usual(15.0, 600.0, "shunting to records")
USUAL = {
    "--contact-stiffness": (Usual(1e7, 1e11, "the paper has 0.1 to 8 GN/m"), "N/m"),
    "--speed": (_SPEED, "km/h"),
    "--speeds": (_SPEED, "km/h"),
    "--step": (Usual(1e-7, 2e-2, "contact to car body"), "s"),
}


def given_here(context: typer.Context, name: str) -> bool:
    """Whether an option was given on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def positions_of(text: str | None, given: FmuOptions) -> list[float] | None:
    """Read ``--position``: numbers of m, or places of our track by name, with commas."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        if given.track_fmu is not None:
            raise UsageError(
                f"--position {text}: must be m, with commas; railseat and midspan are known of "
                "our own track, and not of --track-fmu"
            ) from error
    from railcosim.analysis.response.track_words import place_of

    return [place_of(given.rails(), part.strip()) for part in text.split(",")]


def frequencies_of(text: str, limits: tuple[float, float] | None = None) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, Hz; see `grid_of`."""
    return grid_of("--frequencies", text, "Hz", limits)


def grid_of(
    option: str, text: str, unit: str, limits: tuple[float, float] | None = None
) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, within limits, the option's if not given.

    Raises
    ------
    UsageError
        Saying what is wrong with it.
    """
    import numpy as np

    form = f"start:stop:step ({unit}, stop included) or start:stop:N@log"
    parts = text.removesuffix("@log").split(":")
    try:
        start, stop, third = (float(part) for part in parts)
    except ValueError as error:
        raise UsageError(f"{option} {text}: must be {form}") from error
    least, most = LIMITS[option] if limits is None else limits
    if not (least <= start <= stop <= most and 0 < third < math.inf):
        raise UsageError(
            f"{option} {text}: needs {least:g} <= start <= stop <= {most:g} {unit} and a third "
            "number > 0"
        )
    if text.endswith("@log"):
        count = int(third)
        if count != third:
            raise UsageError(f"{option} {text}: N = {third:g} must be a whole number")
    else:
        count = math.floor((stop - start) / third * (1 + 1e-12) + 1e-9) + 1
    if count > MAX_FREQUENCIES:
        raise UsageError(f"{option} {text}: over {MAX_FREQUENCIES} values")
    if text.endswith("@log"):
        spaced: FloatArray = np.geomspace(start, stop, count)
        return spaced
    grid: FloatArray = start + third * np.arange(count, dtype=np.float64)
    return grid if stop - grid[-1] < 1e-9 * stop else np.append(grid, stop)


def contact_parameters(text: str) -> dict[str, float | bool]:
    """FMU parameters for ``hertz``, ``hertz:k_H``, or a stiffness k_H in N/m.

    With ``hertz:k_H`` the tangent at the static load of the vehicle's wheels is k_H.
    """
    from railcosim.analysis.pair.contact import NONLINEAR, STIFFNESS, TANGENT

    kind, _, tangent = text.partition(":")
    if kind != "hertz":
        return {NONLINEAR: False, STIFFNESS: stiffness_of(text, OR_HERTZ)}
    if not tangent:
        return {NONLINEAR: True}
    return {NONLINEAR: True, TANGENT: stiffness_of(tangent, OR_HERTZ, "hertz:")}


def stiffness_of(text: str, otherwise: str = "", before: str = "") -> float:
    """A contact stiffness in N/m, given `before`; a message says what it may be `otherwise`."""
    try:
        k_H = float(text)
    except ValueError:
        k_H = math.nan
    if not SOFTEST <= k_H <= STIFFEST:
        raise UsageError(
            f"--contact-stiffness {before}{text}: must be a number from {SOFTEST:g} to "
            f"{STIFFEST:g} in N/m{otherwise}" + USUAL["--contact-stiffness"][0].slip(k_H, "N/m")
        )
    return doubted("--contact-stiffness", k_H)


def positive(option: str, value: float, unit: str) -> float:
    """Check a number that must be positive and within the option's limits."""
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{option} {value:g}: must be > 0 {unit}")
    least, most = LIMITS.get(option, (0.0, math.inf))
    if not least <= value <= most:
        raise UsageError(f"{option} {value:g}: must be from {least:g} to {most:g} {unit}")
    return value


def doubted(option: str, value: float) -> float:
    """Warn of a number of our pair that is allowed and unusual: the unit may be another."""
    usual, unit = USUAL[option]
    doubt = usual.doubt(option, value, unit)
    if doubt is not None:
        warnings.warn(doubt, UnusualWarning, stacklevel=2)
    return value


def speed_of(speed: float, option: str = "--speed") -> float:
    """A speed in m/s, from one in km/h that should not have been m/s already."""
    kmh = doubted(option, positive(option, speed, "km/h"))
    whole = 10 * round(0.36 * kmh)  # what 69.4 would be in km/h if it were m/s
    if kmh % 1 and abs(3.6 * kmh - whole) < 0.2 and USUAL[option][0].low <= kmh:
        warnings.warn(
            f"{option} = {kmh:g} km/h: meant {kmh:g} m/s? That is {whole:g} km/h",
            UnusualWarning,
            stacklevel=2,
        )
    return kmh / 3.6
