"""What costs were when they were last kept, so that a slip is seen, on whatever machine.

Machines are made comparable by a yardstick: numpy alone, which no change of ours makes faster.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from time import strftime, thread_time

import numpy as np

COLUMNS = ("what", "seconds", "yardstick", "when", "why")


def seconds(work: Callable[[], object], repeats: int = 3) -> float:
    """Least processor time of some work, after once to warm up; others disturb it little."""
    times = []
    for _ in range(repeats + 1):
        begun = thread_time()
        work()
        times.append(thread_time() - begun)
    return min(times[1:])


def yardstick() -> float:
    """Products of matrices, divisions, small systems of equations: what our costs are made of."""
    random = np.random.default_rng(0)
    a, b = random.standard_normal((2, 300, 300))
    small = random.standard_normal((1000, 8, 8)) + 8.0 * np.eye(8)

    def work() -> None:
        for _ in range(10):
            a @ b
            a / (b * b + 1.0)
        np.linalg.solve(small, small)

    return seconds(work, 30)


class Memory:
    """What each cost was, by a table, and is."""

    def __init__(self, table: Path) -> None:
        self.yardstick = yardstick()
        self.measured: dict[str, float] = {}
        self.kept: dict[str, float] = {}
        self._table = table
        if table.is_file():
            with table.open(newline="", encoding="utf-8") as file:
                for row in csv.DictReader(file):
                    self.kept[row["what"]] = float(row["seconds"]) / float(row["yardstick"])

    def beside(self, what: str, cost: float) -> str:
        """Note a cost (s), and say what it was, on this machine."""
        self.measured[what] = cost
        if what not in self.kept:
            return "new"
        before = self.kept[what] * self.yardstick
        return f"{shown(before)} before"

    def keep(self, why: str) -> None:
        """Add what was measured to the table."""
        is_new = not self._table.is_file()
        with self._table.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            if is_new:
                writer.writerow(COLUMNS)
            for what, cost in self.measured.items():
                numbers = (f"{cost:.3g}", f"{self.yardstick:.3g}")
                writer.writerow([what, *numbers, strftime("%Y-%m-%d"), why])


def shown(cost: float) -> str:
    """Seconds, in s, ms or us."""
    if cost < 1e-4:
        return f"{1e6 * cost:.2f} us"
    return f"{cost:.2f} s" if cost >= 0.1 else f"{1e3 * cost:.3f} ms"
