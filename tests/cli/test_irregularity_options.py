"""Which irregularity the commands take, and that none runs beyond its end."""

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.schemes.grid_run import study
from railcosim.cli import compare, parameter_options, study_command
from railcosim.master.course import Course
from railcosim.master.schemes.jacobi import jacobi
from railcosim.parameters import ArgumentError, ParameterError
from railcosim.track.irregularity import read_profile, synthesise
from railcosim.track.irregularity.named import irregularity


@pytest.fixture
def short(tmp_path):
    """A measured profile of 3 m."""
    path = tmp_path / "short.CSV"
    path.write_text("x,left\n0,0\n1,1e-3\n2,0\n3,1e-3\n")
    return path


def test_seed_chooses_a_track_of_the_class() -> None:
    known = synthesise("fra-5", 50.0, seed=4)
    assert np.array_equal(irregularity("fra-5", 50.0, seed=4).left, known.left)
    assert np.array_equal(irregularity("fra-5", 50.0).left, synthesise("fra-5", 50.0, 1).left)


def test_a_class_is_vertical_unless_more_is_asked_for() -> None:
    assert irregularity("german-low", 50.0).left_y is None
    found = irregularity("german-low", 50.0, quantities=["vertical", "gauge"])
    assert np.array_equal(found.left, irregularity("german-low", 50.0).left)
    assert found.right_y.any()
    assert np.array_equal(found.left_y, -found.right_y)


def test_a_run_in_space_has_all_that_a_class_has() -> None:
    found = irregularity("german-low", 50.0, spatial=True)
    assert found.recipe == irregularity("german-low", 50.0, quantities=["all"]).recipe
    assert irregularity("german-low", 50.0, quantities=["gauge"], spatial=True).left.any() == 0
    assert irregularity("fra-5", 50.0, spatial=True).left_y is None
    assert irregularity("none", 50.0, spatial=True).left_y is None


def test_a_class_fades_in_and_a_file_does_not(short) -> None:
    assert irregularity("german-low", 2.0).fade == 10.0
    assert irregularity(str(short), 2.0).fade == 0.0
    assert irregularity("german-low", 2.0, fade=0.0).fade == 0.0
    assert irregularity(str(short), 2.0, fade=1.5).fade == 1.5


def test_a_file_is_repeated_on_request(short) -> None:
    with pytest.raises(ParameterError, match=r"short.CSV: ends after 3 m.*50 m.*--repeat"):
        irregularity(str(short), 50.0)
    irregularity(str(short), 50.0, repeat=True).check_covers(50.0)


@pytest.mark.parametrize(
    ("text", "options"),
    [("none", {"seed": 1}), ("none", {"fade": 1.0}), ("german-low", {"repeat": True}),
     ("short.csv", {"seed": 1}), ("short.csv", {"quantities": ["all"]})],
)  # fmt: skip
def test_options_that_say_nothing_are_refused(text, options) -> None:
    with pytest.raises(ArgumentError, match=f"{next(iter(options))}.*says nothing") as refused:
        irregularity(text, 10.0, **options)
    assert refused.value.option == f"--{refused.value}"


@pytest.mark.parametrize(
    ("module", "command", "exports"),
    [(parameter_options, "run", "fmus_of"), (study_command, "study", "made"),
     (compare, "compare", "made")],
)  # fmt: skip
def test_commands_refuse_a_profile_that_ends_before_anything_is_made(
    module, command, exports, short, railcosim, monkeypatch
) -> None:
    monkeypatch.setattr(module, exports, None)  # called, it would be another error
    said = railcosim(command, "--out", "r.nc", "--irregularity", short, "--time", "0.1")
    assert said.status == 2
    assert "the run needs 6.944" in said.err


@pytest.mark.parametrize(
    ("options", "said"),
    [(("--defect", "dib:at=3"), "--defect dib:at=3: must be dip, joint"),
     (("--speed", "fast"), "--speed fast: must be a number, km/h, or a file"),
     (("--speed", "brakes.csv", "--time", "3"), "speed brakes.csv: ends after 2 s")],
)  # fmt: skip
def test_defects_and_speeds_are_refused_before_anything_is_made(
    options, said, railcosim, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(parameter_options, "fmus_of", None)
    (tmp_path / "brakes.csv").write_text("time,speed\n0,250\n2,100\n")
    found = railcosim("run", "--out", "r.nc", "--time", "1", *options)
    assert found.status == 2
    assert said in " ".join(found.err.split())


def test_python_refuses_it_before_anything_is_loaded(short) -> None:
    profile = read_profile(short)
    with pytest.raises(ParameterError, match="the run needs 6 m"):
        study({}, short.parent / "study", time=0.1, speed=60.0, irregularity=profile)
    assert not (short.parent / "study").exists()
    journey = Journey(speed=60.0, held=True, profile=profile)
    course = Course(scheme=jacobi(), step=1e-4, stop=0.1)
    with pytest.raises(ParameterError, match="the run needs 6 m"):
        run_pair(short, short, {}, journey, course, lambda done, total: None)
