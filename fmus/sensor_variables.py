"""The variables of a track's sensors: outputs at fixed places."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from railcosim.track.sensor_quantities import Told, described
from railcosim.track.sensors import Sensor

from .port_variables import SHOWN_IN
from .roles import Role
from .scalar import Scalar

NOMINALS = {
    "m": 1e-3, "m/s": 0.1, "m/s2": 10.0, "rad": 1e-3, "rad/s": 0.1, "rad/s2": 10.0, "N": 1e4,
    "N/m": 1e4, "N.m": 1e4, "N.m/m": 1e3, "N/m2": 1e6,
}  # fmt: skip
SHOWN: dict[str, str] = SHOWN_IN | {"N/m": "kN/m", "N.m/m": "kN.m/m"}
STRESS, PRESSURE = "MPa", "kPa"
ANNOTATION = "sensors"
"""What a track FMU says of its sensors, beside what it says of its ring."""


def sensor_name(number: int) -> str:
    """Name of a sensor, which are counted from 1, in the order of the track's parameters."""
    return f"sensor[{number}]"


def sensor_outputs(told: Sequence[Told], known: tuple[str, ...]) -> list[Scalar]:
    """Outputs in the order of the observation.

    Parameters
    ----------
    told : sequence of Told
        What sensors tell.
    known : tuple of str
        What forces on the rails, and so the state at rest, depend on.
    """
    return [
        Scalar(
            name=f"{sensor_name(one.sensor)}.{one.name}", unit=one.unit, description=one.text,
            role=Role.OUT_SEEN, causality="output", index=k, terminal=sensor_name(one.sensor),
            display_unit=_shown(one), nominal=NOMINALS[one.unit],
            depends_on=known if one.moves else (), starts_from=known if one.at_rest else (),
        )
        for k, one in enumerate(told)
    ]  # fmt: skip


def _shown(one: Told) -> str:
    if one.unit == "N/m2":
        return PRESSURE if one.name == "pressure" else STRESS
    return SHOWN.get(one.unit, "")


def sensors_noted(sensors: Iterable[Sensor], told: Sequence[Told]) -> dict[str, str]:
    """What a track says of its sensors: what they are on, where, and their quantities."""
    noted = [
        {
            "name": sensor_name(number), "of": sensor.of, "side": sensor.side, "at": sensor.at,
            "what": described(sensor),
            "quantities": [one.name for one in told if one.sensor == number],
        }
        for number, sensor in enumerate(sensors, start=1)
    ]  # fmt: skip
    return {ANNOTATION: json.dumps(noted)} if noted else {}
