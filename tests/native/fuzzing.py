"""libFuzzer on the reader of model.bin, and on all that is done with a file that it accepts.

`test_resource_file.py` runs it shortly, and always alike. Whoever changes the runtime runs it for
long, with another seed each time:

    python -m tests.native.fuzzing --minutes 15

What it finds is left in the folder `--out` as `crash-*`, `timeout-*` or `leak-*`. Once that is
mended, the file belongs among `found/`, which every run begins with.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from railcosim.fmus.content import contents
from railcosim.fmus.native_runtime.compile import SOURCES, sources
from railcosim.fmus.native_runtime.resource import resource
from railcosim.track.decay import RingWarning
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import FileName, Rolling

HERE = Path(__file__).parent
FLAGS = [
    "-std=c99", "-g1", "-O1", "-fno-omit-frame-pointer", "-DRAILCOSIM_FUZZING",
    "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all",
]  # fmt: skip
COARSE = Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=100.0, highest_frequency=100.0)
WHAT_IS_MISSING = "apt-get install clang libclang-rt-dev"


def build(program: Path) -> str:
    """Compile the fuzzer; why that cannot be done here, if it cannot."""
    clang = shutil.which("clang")
    if clang is None:
        return f"no clang: {WHAT_IS_MISSING}"
    files = [p for p in sources(2) if not p.name.startswith("fmi")]
    own = [HERE / "c" / "fuzz.c", HERE / "c" / "fuzz_numbers.c"]
    command = [clang, *FLAGS, f"-I{SOURCES}", "-o", program, *own, *files, "-lm"]
    told = subprocess.run(
        [os.fspath(part) for part in command], capture_output=True, text=True, check=False
    )
    if "libclang_rt.fuzzer" in told.stderr:
        return f"clang without its fuzzer: {WHAT_IS_MISSING}"
    assert told.returncode == 0, told.stderr
    return ""


def write_seeds(folder: Path) -> None:
    """The four files of a vertical pair, of one in space and of one with profiles and FASTSIM."""
    folder.mkdir()
    wagon = read_stock(Path("wagon"))
    for name, dimension, stock in (
        ("vertical", "vertical", Vehicle()),
        ("spatial", "spatial", wagon),
        ("profiled", "spatial", on_profiles(replace(wagon, rolling=Rolling(creep="fastsim")))),
    ):
        with warnings.catch_warnings(category=RingWarning, action="ignore"):
            all_four = contents(stock, Track(mesh=COARSE), dimension=dimension)
        for content in all_four:
            made = content.body, content.table, "{always the same}", content.profiles
            (folder / f"{name}-{content.name}").write_bytes(resource(*made))


def on_profiles(vehicle: Vehicle) -> Vehicle:
    """A vehicle whose wheels are hollow and steep towards their flanges, on heads of two radii."""
    names = {f"{of}_profile": FileName(f"{of}.csv", HERE / "profiles") for of in ("wheel", "rail")}
    return replace(vehicle, rolling=replace(vehicle.rolling, profile_range=0.01, **names))


def fuzz(program: Path, folder: Path, seed: int, *options: str) -> subprocess.CompletedProcess[str]:
    """Begin with the seeds, and what was found before; leave in `folder` what is found."""
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    if not (folder / "seeds").exists():
        write_seeds(folder / "seeds")
    begin = [p for p in (folder / "seeds", HERE / "found") if p.exists()]
    command: Sequence[object] = [
        program, f"-seed={seed}", "-print_final_stats=1", f"-artifact_prefix={folder}/", *options,
        # Else it begins with short files, and cuts ours; alters the same file up to five times; and
        # holds against us what its parent took (c/fuzz.c).
        "-len_control=0", "-mutate_depth=2", "-rss_limit_mb=0",
        corpus, *begin,
    ]  # fmt: skip
    return subprocess.run(
        [str(part) for part in command], stderr=subprocess.PIPE, text=True, check=False,
        env=os.environ | {"ASAN_OPTIONS": "allocator_may_return_null=1"},
    )  # fmt: skip


def main() -> None:
    """A campaign."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--seed", type=int, default=random.randrange(1, 2**31))
    parser.add_argument("--out", type=Path, default=Path("fuzzing"))
    chosen = parser.parse_args()
    chosen.out.mkdir(exist_ok=True)
    if why := build(chosen.out / "fuzz"):
        raise SystemExit(why)
    print(f"seed {chosen.seed}, {chosen.minutes:g} minutes, in {chosen.out}/")
    seconds = f"-max_total_time={round(60 * chosen.minutes)}"
    told = fuzz(chosen.out / "fuzz", chosen.out, chosen.seed, seconds, "-timeout=60")
    print(told.stderr[-4000:])
    raise SystemExit(told.returncode)


if __name__ == "__main__":
    main()
