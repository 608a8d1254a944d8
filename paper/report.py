"""The numbers of all figures as one table."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from railcosim.plots.page import number
from railcosim.storage.whole import written_whole

from .finding import Finding

COLUMNS = [
    "figure", "quantity", "paper", "ours", "unit", "relative_difference", "spatial",
    "spatial_difference", "note",
]  # fmt: skip


def write_table(findings: Sequence[Finding], path: Path) -> None:
    """Write `COLUMNS` of all findings as CSV; numbers to six digits."""
    with (
        written_whole(path) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for f in findings:
            writer.writerow(
                [f.figure, f.quantity, number(f.paper), number(f.ours, 6), f.unit,
                 number(f.relative_difference, 3), number(f.spatial, 6),
                 number(f.change_in_space, 3), f.note]
            )  # fmt: skip
