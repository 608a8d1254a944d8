"""Fits against the parameters that made the data, textbook regression, and the binomial law."""

import numpy as np
import pytest
from scipy import stats

from railcosim.analysis.fitting.fit import Problem, fit
from railcosim.analysis.fitting.identified import identified
from railcosim.analysis.fitting.measured import read_measured
from railcosim.analysis.fitting.table import Unit
from railcosim.analysis.response.decay_rate import track_decay_rate
from railcosim.analysis.response.track_receptance import track_receptance
from railcosim.master.files import save
from railcosim.parameters import ArgumentError, ParameterError, changed
from railcosim.track.parameters import Slab, Track

GROUND = Track(slab=Slab(present=False))  # rails on fastenings on rigid ground: the cheapest track
PAD = {"fastening.stiffness": 6.5e7, "fastening.damping": 9e3}
FREE = list(PAD)
F = np.geomspace(60, 1500, 16)


def receptance(track, frequency=F, position="railseat"):
    """Equal forces on both rails, which is half the work, by the command's own function."""
    return track_receptance(track, frequency, position=position)["receptance"].values


def written(path, header, *columns, between=","):
    rows = [between.join(f"{x:.12g}" for x in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.fixture(scope="module")
def true_receptance():
    return receptance(changed(GROUND, PAD))


# What a unit says, by hand: (m/s2)/N is -omega^2 m/N, 1 g is 9.80665 m/s2.
FORMS = {
    "receptance": ("freq (Hz),real [m/N],imag [m/N]", lambda H, w: (H.real, H.imag)),
    "mobility": (
        "frequency (Hz),magnitude (mm/s/kN),phase (deg)",
        lambda H, w: (1e6 * np.abs(w * H), np.rad2deg(np.angle(1j * w * H))),
    ),
    "accelerance": (
        "f,H.re (g/N),H.im (g/N)",
        lambda H, w: ((-(w**2) * H / 9.80665).real, (-(w**2) * H / 9.80665).imag),
    ),
    "decibels": (
        "frequency,abs (dB re 1e-6 m/s/N)",
        lambda H, w: (20 * np.log10(np.abs(w * H) / 1e-6),),
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_way_to_write_a_response_is_read(form, true_receptance, tmp_path):
    header, columns = FORMS[form]
    file = written(tmp_path / "m.csv", header, F, *columns(true_receptance, 2 * np.pi * F))
    found = read_measured(file, GROUND).values
    whole = np.abs(true_receptance) if form == "decibels" else true_receptance
    np.testing.assert_allclose(found, whole, rtol=1e-10)  # twelve digits are written


def test_decimal_commas_and_our_own_files(true_receptance, tmp_path):
    rows = np.column_stack([F, true_receptance.real, true_receptance.imag])
    text = "\n".join(";".join(f"{x:.12e}".replace(".", ",") for x in row) for row in rows)
    (tmp_path / "m.csv").write_text(f"frequency (Hz);real (m/N);imag (m/N)\n{text}\n")
    found = read_measured(tmp_path / "m.csv", GROUND).values
    np.testing.assert_allclose(found, true_receptance, rtol=1e-10)


def test_without_noise_the_parameters_come_back(true_receptance, tmp_path):
    """From twice the damping and half the stiffness, with a small interval about them."""
    file = written(
        tmp_path / "m.csv", "frequency (Hz),real (m/N),imag (m/N)", F,
        true_receptance.real, true_receptance.imag,
    )  # fmt: skip
    found = fit(file, GROUND, free=FREE, both_rails=True)
    # Differences leave 1e-8 of curvature in the derivatives, twelve digits 1e-12 in the data.
    np.testing.assert_allclose(found["value"], list(PAD.values()), rtol=1e-6)
    assert (found["upper"] / found["lower"] < 1 + 1e-5).all()
    assert found.attrs["not_identified"] == {}
    assert found.attrs["rms"] < 1e-4


# Two files, on rigid ground.
@pytest.mark.slow
def test_two_places_are_fitted_together(tmp_path):
    """Magnitudes only; the pinned-pinned dip is at one of them."""
    files = [
        written(tmp_path / f"{at}.csv", "f (Hz),magnitude (m/N)", F,
                np.abs(receptance(changed(GROUND, PAD), position=at)))
        for at in ("railseat", "midspan")
    ]  # fmt: skip
    found = fit(files, GROUND, free=FREE, position=["railseat", "midspan"], both_rails=True)
    np.testing.assert_allclose(found["value"], list(PAD.values()), rtol=1e-6)
    assert found["measured[2]"].dims == ("frequency[2]",)


@pytest.mark.parametrize("said", [{"both_rails": True}, {"position": "midspan"}, {"unit": "m/N"}])
def test_what_decay_rates_do_not_ask_is_refused(tmp_path, said):
    file = written(tmp_path / "m.csv", "frequency (Hz),vertical (dB/m)", [800, 1000], [5.0, 4.0])
    with pytest.raises(ParameterError, match="says nothing of decay rates"):
        fit(file, GROUND, free=["fastening.stiffness"], **said)


def test_decay_rates_are_those_of_the_command(tmp_path):
    """From what `decay-rate` gives: of that track there is no residual, of another there is."""
    rates = track_decay_rate(GROUND, 800, 1000)
    file = written(
        tmp_path / "m.csv", "frequency (Hz),vertical (dB/m)", [800, 1000], rates["vertical"]
    )  # nominal centres
    measured = read_measured(file, GROUND)
    np.testing.assert_allclose(measured.residual(GROUND), 0, atol=1e-10)  # twelve digits
    assert (np.abs(measured.residual(changed(GROUND, PAD))) > 0.1).all()


def test_intervals_are_those_of_linear_regression():
    """Of a straight line, by the textbook's formulas in scipy; half of its slope's interval."""
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, 12)
    y = 2 + 3 * x + 0.1 * rng.standard_normal(x.size)
    line = stats.linregress(x, y)
    J = np.stack([np.ones_like(x), x], axis=1)
    residual = line.intercept + line.slope * x - y
    known = identified(["a", "b"], J, residual, [slice(0, x.size)], ["", ""])
    t = stats.t.ppf(0.975, x.size - 2)
    assert known.inflation == 1.0
    np.testing.assert_allclose(
        known.half_width, [t * line.intercept_stderr, t * line.stderr], rtol=1e-10
    )


def test_residuals_that_are_alike_widen_the_intervals():
    """Of an autoregressive process variances of means grow by (1 + r) / (1 - r)."""
    rng = np.random.default_rng(5)
    n, r = 4000, 0.8
    residual = np.zeros(n)
    for k in range(1, n):
        residual[k] = r * residual[k - 1] + rng.standard_normal()
    J = np.ones((n, 1))
    known = identified(["mean"], J, residual, [slice(0, n)], [""])
    # The correlation is known to (1 - r^2) / sqrt(n) = 0.006, so its factor of 9 to 0.3.
    assert known.inflation == pytest.approx(9.0, abs=1.0)


def noisy(H, seed):
    errors = np.random.default_rng(seed).standard_normal((2, H.size))
    return H * np.exp(0.05 * (errors[0] + 1j * errors[1]))


# Three numbers of a track with slabs.
@pytest.mark.slow
def test_two_springs_in_series_are_told_to_be_one(tmp_path):
    """Only the sum of their flexibilities is felt; the fastening is known all the same."""
    track = changed(Track(), {"foundation.ca_layer_stiffness": 1e8})
    H = noisy(receptance(track, F[:8]), 1)
    file = written(tmp_path / "m.csv", "f,real (m/N),imag (m/N)", F[:8], H.real, H.imag)
    both = ["foundation.stiffness", "foundation.ca_layer_stiffness"]
    found = fit(file, track, free=["fastening.stiffness", *both], both_rails=True)
    why = found.attrs["not_identified"]
    assert list(why) == both
    assert "cannot be told from foundation.ca_layer_stiffness (correlation -1.0000)" in why[both[0]]
    assert np.isnan(found["value"].sel(parameter=both)).all()
    assert np.isfinite(found["lower"].sel(parameter="fastening.stiffness"))


@pytest.mark.parametrize(
    ("track", "frequency", "said"),
    [
        (GROUND, F[:6], "has no effect on what was measured"),  # no slab
        # Far above all that a foundation does to a rail.
        (Track(), np.linspace(1200, 1500, 6), r"goes to 6e\+04, the end of where it is looked for"),
    ],
)
def test_what_the_data_cannot_tell_is_refused(track, frequency, said, tmp_path):
    H = noisy(receptance(track, frequency), 1)
    file = written(tmp_path / "m.csv", "f,real (m/N),imag (m/N)", frequency, H.real, H.imag)
    with pytest.raises(ArithmeticError, match=f"foundation.stiffness {said}"):
        fit(file, track, free=["foundation.stiffness"], both_rails=True)


def test_lines_of_no_coherence_do_not_count(true_receptance, tmp_path):
    H = true_receptance.copy()
    coherence = np.full(F.size, 0.999)
    H[::5], coherence[::5] = 1e-3, 0.0
    H[1::5], coherence[1::5] = 1.2 * H[1::5], 0.01  # a fifth too large, and known not to be good
    file = written(
        tmp_path / "m.csv", "f,real (m/N),imag (m/N),coherence", F, H.real, H.imag, coherence
    )
    found = fit(file, GROUND, free=FREE, both_rails=True)
    np.testing.assert_allclose(found["value"], list(PAD.values()), rtol=1e-3)


# 30 searches on rigid ground.
@pytest.mark.slow
def test_intervals_hold_as_often_as_they_say(true_receptance, tmp_path):
    """Of 30 trials; how often, and how wide, within what chance does in one of ten thousand."""
    trials = 30
    true = changed(GROUND, PAD)
    off = []
    for seed in range(trials):
        H = noisy(true_receptance, seed)
        file = written(tmp_path / "m.csv", "f,real (m/N),imag (m/N)", F, H.real, H.imag)
        problem = Problem(
            true, tuple(FREE), (read_measured(file, true, both_rails=True),), lambda: None
        )
        found = problem.solved(np.zeros(2))
        J = problem.jacobian(found.x)
        known = identified(FREE, J, found.fun, problem.runs, ["", ""])
        off.append(found.x / known.half_width)  # logarithms from the true ones
    inside = np.sum(np.abs(off) < 1, axis=0)
    assert (inside >= stats.binom.ppf(1e-4, trials, 0.95)).all()
    # Times the quantile they are Student's t of 30 degrees, whose square has the mean 30 / 28.
    squares = stats.t.ppf(0.975, 2 * F.size - 2) ** 2 * np.sum(np.square(off), axis=0)
    low, high = stats.chi2.ppf([1e-4, 1 - 1e-4], trials)
    assert ((low < squares) & (squares < 30 / 28 * high)).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1,2\n3,4\n", "its first line must name the columns"),
        ("f,real (m/N),imag (m/N)\n10,1e-9\n", "line 2: must be 3 finite numbers"),
        ("f,real (m/N),imag (m/N)\n10,1e-9,inf\n", "line 2: must be 3 finite numbers"),
        ("f,magnitude\n10,1e-9\n20,1e-9\n", "unit '': must be one such as m/N"),
        ("f,magnitude (furlong)\n10,1e-9\n20,1e-9\n", "unit 'furlong'"),
        ("f,magnitude (m/N)\n10,1e-9\n10,2e-9\n", "10 Hz is there twice"),
        ("f,magnitude (m/N)\n10,0\n20,1e-9\n", "all magnitudes must be > 0"),
        ("f (min),magnitude (m/N)\n10,1e-9\n20,1e-9\n", "must be Hz or kHz"),
        ("x,magnitude (m/N)\n10,1e-9\n20,1e-9\n", "no column is called frequency"),
        ("f,magnitude (m/N),coherence\n10,1e-9,1.2\n", "coherence: must be from 0 to 1"),
        ("f,vertical (dB/m)\n105,1\n125,2\n", "105 Hz is no centre of a third octave"),
        ("f,temperature (degC)\n10,1\n20,1\n", "no receptance and no decay rate found"),
    ],
)
def test_files_that_cannot_be_are_refused(text, said, tmp_path):
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(ParameterError, match=r"m\.csv") as refused:
        read_measured(tmp_path / "m.csv", GROUND)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("free", "said"),
    [
        (["fastening.stifness"], "did you mean fastening.stiffness"),
        (["fastening.loss_factor"], "say where to start"),
        (["mesh.cells"], "not a whole one"),
        (["fastening.stiffness"] * 2, "given twice"),
        (["fastening.stiffness", "fastening.damping", "rail.mass_per_length"], "free fewer"),
    ],
)
def test_parameters_that_cannot_be_free_are_refused(free, said, tmp_path):
    file = written(tmp_path / "m.csv", "f,magnitude (m/N)", [100, 200, 300.0], [1e-8] * 3)
    with pytest.raises((ArgumentError, ParameterError), match=said):
        fit(file, GROUND, free=free)


def test_units():
    assert Unit.of("mm/s2/kN") == Unit(2, 1e-6, decibels=False)
    assert Unit.of("(m/s2)/N") == Unit(2, 1.0, decibels=False)
    assert Unit.of("dB re 1e-6 m/N") == Unit(0, 1e-6, decibels=True)
    assert Unit.of("m/N/s") is None
    assert Unit.of("dB re x m/N") is None


def test_a_file_of_ours_says_how_the_rail_was_hit(tmp_path):
    """Both rails, midspan, by default of the command that wrote it; other words are refused."""
    computed = track_receptance(GROUND, F, position="midspan")
    save(computed, tmp_path / "r.nc")
    save(computed, tmp_path / "r.csv")
    measured = read_measured(tmp_path / "r.nc", GROUND)
    assert measured.of(GROUND, F) == pytest.approx(computed["receptance"].values, rel=1e-12)
    read_measured(tmp_path / "r.nc", GROUND, both_rails=True, position="midspan", direction="z")
    for other, said in {
        ("both_rails", False): "is --load both, as it says itself, not --load single",
        ("position", "railseat"): "is --position midspan",
        ("direction", "y"): "is --direction z",
    }.items():
        with pytest.raises(ParameterError, match=said):
            read_measured(tmp_path / "r.nc", GROUND, **dict([other]))
    with pytest.raises(ParameterError, match="on which rails the load was: add --load"):
        read_measured(tmp_path / "r.csv", GROUND)
    read_measured(tmp_path / "r.csv", GROUND, both_rails=True)
    save(track_receptance(GROUND, F, offset=0.02, response="y"), tmp_path / "o.nc")
    with pytest.raises(ParameterError, match=r"offset = 0.02: a fit is of"):
        read_measured(tmp_path / "o.nc", GROUND)
