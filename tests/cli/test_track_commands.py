"""railcosim dispersion and decay-rate as a user meets them."""

import pytest

from railcosim.master.files import load


def test_dispersion_and_its_picture(railcosim, tmp_path):
    done = railcosim(
        "dispersion", "--set", "slab.present=false", "--frequencies", "100:1200:100",
        "--speed", 300, "--out", "d.csv", "--plot", "d.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    assert "stop bands, Hz (2; if nothing damps the track): 0 to 141.2, 1056 to 1074" in done.out
    assert "lowest phase velocity" in done.out
    found = load(tmp_path / "d.csv")
    assert found["wave[1].wavenumber"].attrs["units"] == "rad/m"
    assert found["wave[2].decay"].attrs["units"] == "dB/m"
    assert (tmp_path / "d.png").stat().st_size > 10_000


def test_decay_rate_and_its_picture(railcosim, tmp_path):
    done = railcosim(
        "decay-rate", "--track", "ballasted", "--bands", "800:1000", "--out", "r.nc",
        "--plot", "r.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    assert "lateral" not in done.out
    assert load(tmp_path / "r.nc").sizes["frequency"] == 2
    assert (tmp_path / "r.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("dispersion", "--frequencies", "0:5:1"), "--frequencies"),
        (("dispersion", "--direction", "y", "--track", "ballasted"), "no lateral stiffness"),
        (("dispersion", "--out", "waves.txt"), "must end in .nc or .csv"),
        (("decay-rate", "--bands", "100"), "must be from:to"),
        (("decay-rate", "--bands", "100:50"), "lowest <= highest"),
    ],
)
def test_mistakes(railcosim, command, said):
    done = railcosim(*command)
    assert done.status == 2
    assert said in done.err


def test_modes_of_a_track(railcosim, tmp_path):
    done = railcosim("modes", "track", "--track", "booted", "--out", "m.csv")
    assert done.status == 0, done.err
    assert "pinned-pinned, vertical" in done.out
    found = load(tmp_path / "m.csv")
    assert float(found["undamped_frequency"].sel(name="pinned-pinned, vertical")) > 1000
    done = railcosim("modes", "track", "--speed", 100)
    assert done.status == 2
    assert "--speed: is of a vehicle" in done.err


def test_fit_of_what_track_receptance_wrote(railcosim, tmp_path):
    """Both rails were loaded; the damping was a quarter less."""
    given = ("--set", "slab.present=false", "--set", "fastening.damping=2e4")
    done = railcosim("track-receptance", *given, "--frequencies", "80:800:6@log", "--out", "m.csv")
    assert done.status == 0, done.err
    done = railcosim(
        "fit", "m.csv", "--set", "slab.present=false", "--free", "fastening.damping", "--load",
        "both", "--out", "f.csv", "--plot", "f.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    assert "to go on with it: --set fastening.damping=20000" in done.out
    assert float(load(tmp_path / "f.csv")["value"][0]) == pytest.approx(2e4, rel=1e-6)
    assert (tmp_path / "f.png").stat().st_size > 10_000
    done = railcosim("fit", "m.csv", "--free", "fastening.dampin", "--load", "both")
    assert done.status == 2
    assert "did you mean fastening.damping" in done.err


def test_transmission_of_a_softer_pad_and_its_picture(railcosim, tmp_path):
    """--set is of --track alone; a vehicle's numbers are asked for with irregularity only."""
    given = ("--track", "booted", "--bands", "31.5:40", "--set", "block.stiffness=1e7")
    done = railcosim(
        "transmission", *given, "--against", "booted", "--out", "t.csv", "--plot", "t.png"
    )
    assert done.status == 0, done.err
    found = load(tmp_path / "t.csv")
    assert found["insertion_loss"].attrs["units"] == "dB"
    assert (found["insertion_loss"] != 0).all()
    assert (tmp_path / "t.png").stat().st_size > 10_000
    done = railcosim("transmission", *given, "--vehicle", "paper")
    assert done.status == 2
    assert "--vehicle: is of a vehicle; give --input irregularity" in done.err
    done = railcosim("transmission", "--track", "booted", "--bands", "0.1:40")
    assert done.status == 2
    assert "needs 1 <= lowest" in done.err


def test_tracks_one_behind_the_other(railcosim, tmp_path):
    done = railcosim(
        "track-receptance", "--then", "ballasted@0", "--then", "floating@1.2", "--position", 0.4,
        "--frequencies", "10:50:20", "--out", "t.nc",
    )  # fmt: skip
    assert done.status == 0, done.err
    found = load(tmp_path / "t.nc")
    assert found.sizes["frequency"] == 3
    assert found.attrs["track"] == "paper, then ballasted from 0 m, floating from 1.2 m"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--then", "ballasted"), "must be TRACK@PLACE"),
        (("--then", "ballasted@0", "--then", "paper@0"), "farther than the one before"),
        (("--then", "ballasted@0", "--then", "paper@1"), "ballasted from 0 to 1 m: must be whole"),
        (("--then", "ballasted@0", "--position", "railseat"), "must be in m along the track"),
        (("--then", "ballasted@0", "--ring"), "--ring: --then joins tracks without end"),
    ],
)
def test_tracks_that_do_not_join(railcosim, more, said):
    done = railcosim("track-receptance", "--position", 1, *more, "--out", "t.nc")
    assert done.status == 2
    assert said in done.err
