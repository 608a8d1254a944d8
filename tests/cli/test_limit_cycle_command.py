"""What is told of limit cycles, also of runs that did not settle."""

import numpy as np

from railcosim.master.files import load


def test_what_has_not_settled_is_told_and_has_no_number(railcosim, tmp_path):
    """Half a second is too short for what swings; rest below 312 km/h is known to stay."""
    done = railcosim(
        "limit-cycle", "--vehicle", "manchester", "--speeds", "300:300:1", "--longest", "0.5",
        "--out", "c.csv", "--plot", "c.png",
    )  # fmt: skip
    assert done.status == 0, done.err
    row = next(line for line in done.out.splitlines() if "300.0" in line)
    assert [cell.strip() for cell in row.split("│")[1:6]] == [
        "300.0",
        "0.00",
        "",
        "not settled",
        "",
    ]
    assert "312.5 km/h" in done.out
    kept = load(tmp_path / "c.csv")
    assert kept["amplitude_up"].values.tolist() == [0.0]
    assert np.isnan(kept["amplitude_down"].values).all()
    assert kept["how_down"].values.tolist() == [1.0]
    assert (tmp_path / "c.png").stat().st_size > 1000


def test_bad_input(railcosim):
    for options, says in (
        (["--speeds", "100:50:1"], "--speeds 100:50:1: needs"),
        (["--longest", "0"], "--longest 0: must be > 0 s"),
        (["--vehicle", "none.toml"], "none.toml"),
    ):
        done = railcosim("limit-cycle", *options)
        assert done.status == 2
        assert says in done.err
