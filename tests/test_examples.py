"""Every example runs and prints what its reader is told to expect."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
SAYS = {  # what the paper and the other tests say as well
    "slab_track_receptance": ["first resonance: 53.2 Hz", "pinned-pinned: 1056 Hz"],
    "moving_wheels": ["79.3 kN at rest"],
    "critical_speeds": ["car body bounce, n = 1: 39.4 km/h at 15.70 m", "31.40 m"],
    "own_parameters": ["30 kN/mm", "60 kN/mm"],
    "linear_track": ["first resonance: 53.2 Hz"],
    # What the matrices worked out by hand in tests/master/test_two_mass.py give, too.
    "two_mass_oscillator": ["force/displacement, Jacobi, constant: stable to |Lambda| H = 1.163"],
    "coupled_response": ["flexible track: 31.9 Hz", "rigid track: 94."],
}
MORE = {"two_mass_oscillator": ["5"]}  # a picture of 25 points instead of 169
# They need exudyn: test_exudyn_example.py.
ELSEWHERE = {
    "exudyn_vehicle", "exudyn_model", "exudyn_track", "exudyn_spatial", "exudyn_spatial_model",
}  # fmt: skip


def test_all_examples_are_tested() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(SAYS) | ELSEWHERE


# Up to a minute for the one that linearises the track; the examples are what users copy.
@pytest.mark.slow
@pytest.mark.parametrize("name", SAYS)
def test_example(name, tmp_path) -> None:
    picture = tmp_path / "picture.png"
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), str(picture), *MORE.get(name, [])],
        cwd=tmp_path, env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for words in SAYS[name]:
        assert words in done.stdout
    assert picture.stat().st_size > 5000
