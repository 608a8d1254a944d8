"""Track.fmu in other hands: a vehicle of exudyn, and the loop of docs/plug-in.md."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ALONE = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def run(*arguments: str, cwd: Path) -> str:
    """Run Python in a process of its own: FMUs in Python share the modules of their host."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd, env=ALONE, capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


# Half a minute: the vehicle of another tool is what Track.fmu is for.
@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("exudyn") is None, reason='exudyn is not installed: pip install "railcosim[examples]"'
)
def test_exudyn_agrees_with_our_vehicle(tmp_path) -> None:
    """RMS and largest difference within 0.3 % of the dynamic part; the half step is no worse.

    The vehicles are the same, so only time steps differ: contact forces by 0.13 % at most, and
    0.065 % in the mean of squares is what our own steps of 0.025 ms leave, whatever exudyn's are.
    The first 0.3 s are worst: the irregularity fades in, and the rails ring because wheels begin to
    roll. A sharp test: 2 % more of primary damping or secondary stiffness, or 1 % of wheelset mass,
    fail it.
    """
    printed = run(
        str(ROOT / "examples" / "exudyn_vehicle.py"), "picture.png", "--time", "0.3", cwd=tmp_path
    )
    table = [(line[:26].strip(), line[26:].split()) for line in printed.splitlines()]
    rows = {name: [float(x) for x in cells] for name, cells in table if name.startswith("exudyn")}
    assert len(rows) == 4
    for name, differences in rows.items():
        assert len(differences) == 8, name
        assert max(differences) < 0.3, name  # %
    assert rows["exudyn, implicit, 0.05 ms"][0] < rows["exudyn, implicit, 0.1 ms"][0]
    # Both are at our own steps' error, printed to 0.001.
    fine, coarse = (rows[f"exudyn, explicit, {step} ms"][0] for step in ("0.005", "0.01"))
    assert fine < coarse + 0.01
    assert (tmp_path / "picture.png").stat().st_size > 5000


# A minute and a half: an independent law of rolling wheels, on the track in space.
@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("exudyn") is None, reason='exudyn is not installed: pip install "railcosim[examples]"'
)
def test_exudyn_rolls_in_space_as_our_vehicle(tmp_path) -> None:
    """Where rails bend: motions within 0.02 %, forces within 1 %, by vectors and other integrators.

    Forces aside differ by 0.2 % of their change (RMS), which is what our own step of 0.025 ms
    leaves: with 0.05 ms it is three times that. Forces down are those of rails that ring at first.
    """
    script = str(ROOT / "examples" / "exudyn_spatial.py")
    printed = run(script, "picture.png", "--time", "0.3", cwd=tmp_path)
    table = [(line[:20].strip(), line[20:].split()) for line in printed.splitlines()]
    rows = {name: [float(x) for x in cells] for name, cells in table if name.startswith("exudyn")}
    assert list(rows) == ["exudyn, 0.2 ms", "exudyn, 0.1 ms"]
    coarse, fine = rows.values()
    aside, yaw, force_aside, force_down = (fine[k] for k in (0, 2, 4, 6))  # RMS
    assert max(aside, yaw) < 0.05
    assert max(force_aside, force_down) < 1.0
    assert force_down < coarse[6]
    assert (tmp_path / "picture.png").stat().st_size > 5000


def test_exudyn_missing_is_one_line(tmp_path) -> None:
    """Someone without exudyn is told what to do."""
    (tmp_path / "exudyn.py").write_text("raise ModuleNotFoundError(\"No module named 'exudyn'\")")
    script = str(ROOT / "examples" / "exudyn_vehicle.py")
    done = subprocess.run(
        [sys.executable, script], env={**ALONE, "PYTHONPATH": str(tmp_path)},
        cwd=tmp_path, capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "pip install exudyn" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_loop_of_the_page(exported, tmp_path) -> None:
    """The loop runs as printed, its wheels carry their load, and half the step says the same."""
    (tmp_path / "fmus").symlink_to(exported["Track"].parent)
    page = (ROOT / "docs" / "plug-in.md").read_text(encoding="utf-8")
    loop = next(
        block
        for block in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
        if "h = np.zeros(8), [], 1e-5" in block
    )
    spans = []
    for number, step in enumerate(("1e-5", "5e-6")):
        script = tmp_path / f"loop{number}.py"
        script.write_text(loop.replace("1e-5  # s", step))
        low, _, high, _ = run(str(script), cwd=tmp_path).split()
        spans.append((float(low), float(high)))
    (low, high), fine = spans
    # The dip moves forces by 5 kN; a loop that hammers goes from 0 to several times the load.
    assert 60e3 < low < 79264.8 < high < 100e3
    # Coupling and loop are of second order: measured 10 N of the 5 kN.
    assert fine == pytest.approx((low, high), abs=50.0)
