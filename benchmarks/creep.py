"""Cost of a contact by its law of creep, compiled, as a table: forces, and with derivatives.

Microseconds of a processor, the least of many asks of a thousand contacts in turn.

    python benchmarks/creep.py
"""

from __future__ import annotations

from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.rolling import at_ports, numbers
from railcosim.fmus.content import start_of
from railcosim.fmus.native_runtime.rolling import CompiledRolling, compiled_rolling
from railcosim.mechanics.ports import DIMENSIONS, Layout
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling
from railcosim.vehicle.rolling import CREEP

PLACES = [18.5, 16.0, 2.8, 0.3]  # m
LAYOUT, TIMES, ASKS, SPEED = Layout(4, directions=DIMENSIONS["spatial"]), 125, 40, 60.0
SPREAD = [2e-5, 1e-3, 5e-5, 1e-3, 1e-3, 1e-5, 2e-4, 1e-4, *(8 * [0.02])]
"""Of motions at a contact, and of their rates."""


def law_of(creep: str) -> CompiledRolling:
    """Of the default vehicle's contacts."""
    contact = start_of(Vehicle(rolling=Rolling(creep=creep)), PLACES, dimension="spatial").contact
    assert contact is not None
    given = {row.name: row.start for row in contact.parameters()}
    law = compiled_rolling(at_ports(given, LAYOUT), numbers(given, LAYOUT), None)
    assert law is not None
    return law


def main() -> None:
    """Print the table."""
    moving = np.random.default_rng(1).standard_normal((TIMES, LAYOUT.contacts, 16)) * SPREAD
    moving[..., 0] += 1e-4  # pressed
    motion = np.concatenate([moving, np.full((TIMES, LAYOUT.contacts, 1), SPEED)], axis=-1)
    laws = {name: law_of(name) for name in CREEP}
    least: dict[tuple[str, str], float] = {}
    for _ in range(ASKS):
        for name, law in laws.items():
            for what in ("force", "tangent"):
                begin = process_time()
                getattr(law, what)(motion)
                spent = process_time() - begin
                least[name, what] = min(least.get((name, what), spent), spent)
    table = Table("creep", "forces, us", "with derivatives, us")
    for name in laws:
        each = [1e6 * least[name, w] / (TIMES * LAYOUT.contacts) for w in ("force", "tangent")]
        table.add_row(name, *(f"{one:.2f}" for one in each))
    Console().print(table)


if __name__ == "__main__":
    main()
