"""Do the tests notice? Each mutant of `mutants.toml` is one wrong line; a test must fail for it.

A mutant's own tests run first, in a copy of the tree; if they all pass, every test runs. One that
none notices has survived: a test is missing. Those that change nothing that could be seen say why.

    python benchmarks/mutants.py [--jobs 2] [--only WORD] [--own] [--out mutants.csv]
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

HOME = Path(__file__).parents[1]
LONGEST = 900.0  # s; a mutant that makes tests hang is noticed, by whoever waits
PASSED, FAILED = 0, 1  # pytest's exit statuses; any other says that it could not test
KILLED, SURVIVED = "killed", "SURVIVED"


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change: `old` becomes `new` in `file`; `tests` are where it should be noticed first."""

    file: str
    old: str
    new: str
    tests: list[str]
    what: str

    def apply(self, tree: Path) -> None:
        """Change the file; the old text must stand there once, or the list is out of date."""
        path = tree / self.file
        text = path.read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file}: {text.count(self.old)} times, not once: {self.old!r}")
        path.write_text(text.replace(self.old, self.new), encoding="utf-8")


def tracked() -> list[str]:
    """Files of the project."""
    listed = subprocess.run(["git", "ls-files"], cwd=HOME, check=True, capture_output=True)
    return listed.stdout.decode().splitlines()


@contextmanager
def copied(files: list[str]) -> Iterator[Path]:
    """A copy of the tree, importable as `railcosim` from its folder `view`."""
    with tempfile.TemporaryDirectory(prefix="mutant_") as folder:
        tree = Path(folder)
        for file in files:
            (tree / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(HOME / file, tree / file)
        view = tree / "view" / "railcosim"
        view.mkdir(parents=True)
        for part in {Path(f).parts[0] for f in files if f.count("/")}:
            (view / part).symlink_to(tree / part)
        yield tree


def tested(tree: Path, where: list[str]) -> int:
    """Run tests in a tree until one fails; pytest's exit status."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    command += ["-m", "not importers", *where]  # also those that are slow
    environment = {
        **os.environ,
        "PYTHONPATH": str(tree / "view"),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    try:
        run = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return FAILED
    if run.returncode not in (PASSED, FAILED):
        # A mutant that no module can be imported with, or that crashes the process, is noticed.
        text = (run.stdout + run.stderr).decode(errors="replace")
        if "no tests ran" in text or "file or directory not found" in text:
            raise ValueError(f"cannot test {' '.join(where)}: {text.strip()[-300:]}")
        return FAILED
    return run.returncode


def judged(mutant: Mutant, files: list[str], *, own: bool) -> tuple[str, float]:
    """Whether a mutant is noticed, and how long that took (s)."""
    begun = time.monotonic()
    with copied(files) as tree:
        mutant.apply(tree)
        places = [mutant.tests] if own else [mutant.tests, ["tests"]]
        noticed = any(tested(tree, place) == FAILED for place in places)
    return KILLED if noticed else SURVIVED, time.monotonic() - begun


def check_unchanged(mutants: list[Mutant], files: list[str]) -> None:
    """See that the tests pass without any mutant: else all would count as killed."""
    where = sorted({place for mutant in mutants for place in mutant.tests})
    with copied(files) as tree:
        if tested(tree, where) != PASSED:
            raise SystemExit(f"tests fail without any mutant: pytest {' '.join(where)}")


def main() -> None:
    """Try all mutants of the list, print what became of each, and how many lived."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--jobs", type=int, default=2, help="trees tested at once")
    options.add_argument("--only", default="", help="those with this word in file or text")
    options.add_argument("--own", action="store_true", help="their own tests only")
    options.add_argument("--out", type=Path, help="the table, CSV")
    given = options.parse_args()
    listed = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    mutants = [Mutant(**m) for m in listed["mutant"] if given.only in f"{m['file']} {m['what']}"]
    files, console = tracked(), Console()
    check_unchanged(mutants, files)
    rows = []
    with ThreadPoolExecutor(given.jobs) as pool:
        tasks = {pool.submit(judged, m, files, own=given.own): m for m in mutants}
        for task in as_completed(tasks):
            mutant, (fate, seconds) = tasks[task], task.result()
            rows.append((fate, mutant.file, mutant.what, f"{seconds:.0f}"))
            console.print(f"{fate:9}{mutant.file}: {mutant.what} ({seconds:.0f} s)", markup=False)
    if given.out:
        with given.out.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([("fate", "file", "mutant", "seconds"), *sorted(rows)])
    alive = sum(fate == SURVIVED for fate, *_ in rows)
    console.print(f"{len(rows)} mutants: {len(rows) - alive} killed, {alive} survived")
    sys.exit(1 if alive else 0)


if __name__ == "__main__":
    main()
