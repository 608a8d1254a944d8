"""Do the tests notice? Each mutant of `mutants.toml` is one wrong line; a test must fail for it.

A mutant's own tests run in a copy of the tree. One that none of them notices has survived: a test
is missing where one would look for it. Those that failed must pass without any mutant.

    python benchmarks/mutants.py [--jobs 2] [--only WORD] [--out mutants.csv]
"""

from __future__ import annotations

import argparse
import csv
import json
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
PACKAGE = "api"  # folder of what is in `railcosim` itself; see pyproject.toml
LONGEST = 900.0  # s; a mutant that makes tests hang is noticed, by whoever waits
PASSED, FAILED = 0, 1  # pytest's exit statuses; any other says that it could not test
KILLED, SURVIVED = "killed", "SURVIVED"


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """One change: `old` becomes `new` in `file`; `tests` are where it should be noticed."""

    file: str
    old: str
    new: str
    tests: list[str]
    what: str

    def mutated(self) -> str:
        """Text of the file changed; the old one must stand there once, or the list is out of date.

        Raises
        ------
        ValueError
            If it does not.
        """
        text = (HOME / self.file).read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise ValueError(f"{self.file}: {text.count(self.old)} times, not once: {self.old!r}")
        return text.replace(self.old, self.new)


def outdated(mutants: list[Mutant]) -> list[str]:
    """What of the list no longer fits the tree: all of it, to be mended at one go."""
    amiss = []
    for mutant in mutants:
        try:
            mutant.mutated()
        except (OSError, ValueError) as error:
            amiss.append(f"{mutant.what}: {error}")
        amiss += [
            f"{mutant.what}: no {test}"
            for test in mutant.tests
            if not (HOME / test.partition("::")[0]).exists()
        ]
    return amiss


@dataclass(frozen=True, kw_only=True)
class Fate:
    """What became of a mutant: by which test, and how long that took (s)."""

    mutant: Mutant
    fate: str
    by: list[str]
    seconds: float


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
        parts = {Path(f).parts[0] for f in files if f.count("/")} - {PACKAGE}
        for part in [*(tree / p for p in parts), *(tree / PACKAGE).iterdir()]:
            (view / part.name).symlink_to(part)
        yield tree


def failing(tree: Path, where: list[str], *options: str, limit: float | None) -> list[str]:
    """Run tests in a tree, and name those that fail; all where a crash or the limit hides which."""
    cache = tree / ".pytest_cache"
    shutil.rmtree(cache, ignore_errors=True)
    command = [sys.executable, "-m", "pytest", "-q", "-o", f"cache_dir={cache}", *options]
    command += ["-m", "not importers", *where]  # also those that are slow
    environment = {
        **os.environ,
        "PYTHONPATH": str(tree / "view"),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    try:
        run = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        return where
    if run.returncode not in (PASSED, FAILED):
        # A mutant that no module can be imported with, or that crashes the process, is noticed.
        text = (run.stdout + run.stderr).decode(errors="replace")
        if "no tests ran" in text or "file or directory not found" in text:
            raise ValueError(f"cannot test {' '.join(where)}: {text.strip()[-300:]}")
    named = cache / "v" / "cache" / "lastfailed"
    if run.returncode == PASSED:
        return []
    return list(json.loads(named.read_text())) if named.exists() else where


def judged(mutant: Mutant, files: list[str]) -> Fate:
    """Whether a mutant is noticed, and by what."""
    begun = time.monotonic()
    with copied(files) as tree:
        (tree / mutant.file).write_text(mutant.mutated(), encoding="utf-8")
        by = failing(tree, mutant.tests, "-x", limit=LONGEST)
    fate = KILLED if by else SURVIVED
    return Fate(mutant=mutant, fate=fate, by=by, seconds=time.monotonic() - begun)


def main() -> None:
    """Try all mutants of the list, write what became of each as it is known, and how many lived."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--jobs", type=int, default=2, help="trees tested at once")
    options.add_argument("--only", default="", help="those with this word in file or text")
    options.add_argument("--out", type=Path, default=os.devnull, help="the table, CSV")
    given = options.parse_args()
    known = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["mutant"]
    mutants = [Mutant(**m) for m in known if given.only in f"{m['file']} {m['what']}"]
    if amiss := outdated(mutants):  # before hours are spent
        sys.exit("\n".join(["these are not there any more; mend mutants.toml:", *amiss]))
    listed = subprocess.run(["git", "ls-files"], cwd=HOME, check=True, capture_output=True)
    files = listed.stdout.decode().splitlines()
    console, fates = Console(), list[Fate]()
    with (
        given.out.open("w", newline="", encoding="utf-8") as file,
        ThreadPoolExecutor(given.jobs) as pool,
    ):
        table = csv.writer(file)
        table.writerow(["fate", "file", "mutant", "by", "seconds"])
        tasks = [pool.submit(judged, m, files) for m in mutants]
        for task in as_completed(tasks):
            one = task.result()
            fates.append(one)
            by, taken = " ".join(one.by), f"{one.seconds:.0f}"
            row = [one.fate, one.mutant.file, one.mutant.what, by, taken]
            table.writerow(row)
            file.flush()
            console.print("{}  {}: {} ({}, {} s)".format(*row), markup=False)
    killed = sum(one.fate == KILLED for one in fates)
    console.print(f"{len(fates)} mutants: {killed} killed, {len(fates) - killed} survived")
    names = sorted({name for one in fates for name in one.by})
    with copied(files) as tree:
        anyway = failing(tree, names, limit=None) if names else []
    if anyway:
        console.print("they fail without any mutant, and show nothing:", *anyway, markup=False)
    sys.exit(1 if anyway or killed < len(fates) else 0)


if __name__ == "__main__":
    main()
