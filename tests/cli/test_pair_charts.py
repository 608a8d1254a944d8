"""Units on the axes of results: numbers that a label's unit must fit."""

import numpy as np
import pytest
import xarray as xr

from railcosim.cli.pair_charts import response_chart, run_chart


def panels(chart):
    return {row[0].y_label: row[0] for row in chart.rows}


def test_a_run_is_drawn_in_the_units_of_its_axes() -> None:
    """79 kN of contact force, a wheel 1.5 mm down, 0.2 m/s2: in SI in the file."""
    values = {
        "wheelset[1].left.force_z": 79e3, "wheelset[4].left.force_z": 78e3,
        "wheelset[1].left.wheel_z": 1.5e-3, "wheelset[1].left.rail_z": 1e-3,
        "bogie[2].az": 0.3, "carbody.az": 0.2,
    }  # fmt: skip
    run = xr.Dataset({k: ("time", [v, v]) for k, v in values.items()}, {"time": [0.0, 1.0]})
    shown = {
        label: {c.name: c.y[-1] for c in panel.curves}
        for label, panel in panels(run_chart(run)).items()
    }
    expected = {
        "contact force (kN)": {"wheelset 1, left": 79, "wheelset 4, left": 78},
        "down (mm)": {"wheelset 1, left: wheel": 1.5, "wheelset 1, left: rail": 1.0},
        "bogie acceleration (m/s²)": {"bogie 2": 0.3},
        "car body acceleration (m/s²)": {"car body": 0.2},
    }
    assert shown == {label: pytest.approx(curves) for label, curves in expected.items()}


def test_a_run_in_space_is_drawn_aside_as_well() -> None:
    values = {
        "wheelset[2].left.force_z": 79e3, "wheelset[2].left.force_y": -2e3,
        "wheelset[2].right.force_y": 3e3, "wheelset[2].left.rail_y": 4e-4,
        "carbody.az": 0.2, "carbody.ay": 0.1, "bogie[1].ay": 0.5,
    }  # fmt: skip
    run = xr.Dataset({k: ("time", [v, v]) for k, v in values.items()}, {"time": [0.0, 1.0]})
    shown = {
        label: {c.name: c.y[-1] for c in panel.curves}
        for label, panel in panels(run_chart(run)).items()
    }
    expected = {
        "contact force (kN)": {"wheelset 2, left": 79},
        "wheel on rail, to the right (kN)": {"wheelset 2, left": -2},
        "to the right (mm)": {"wheelset 2, left: rail": 0.4},
        "car body acceleration (m/s²)": {
            "car body, acceleration down": 0.2,
            "car body, acceleration to the right": 0.1,
        },
    }
    assert shown == {label: pytest.approx(curves) for label, curves in expected.items()}


@pytest.mark.parametrize(
    ("excitation", "per"), [("irregularity_z", "m"), ("wheelset[2].rail_force_z", "N")]
)
def test_a_response_is_per_unit_of_what_excites(excitation, per) -> None:
    values = {"carbody.z": [3 + 4j, 0j], "wheelset[1].left.force_z": [1j, 2j]}
    frf = xr.Dataset(
        {name: ("frequency", v) for name, v in values.items()},
        {"frequency": [1.0, 2.0]}, {"excitation": excitation},
    )  # fmt: skip
    shown = panels(response_chart(frf))
    assert list(shown) == [f"|displacement| (m/{per})", f"|contact force| (N/{per})"]
    motion, force = (panel.curves[0] for panel in shown.values())
    assert (motion.name, force.name) == ("car body", "wheelset 1, left")
    assert np.array_equal(motion.y, [5.0, 0.0])
    assert np.array_equal(force.y, [1.0, 2.0])


def test_a_train_is_drawn_whole() -> None:
    """All car bodies and bogies; of 32 wheelsets eight, the first and the last among them."""
    names = [f"wheelset[{i}].left.force_z" for i in range(1, 33)]
    names += ["vehicle[1].carbody.az", "carbody[2].az", "bogie[3].az", "wheelset[2].az"]
    run = xr.Dataset({k: ("time", [1.0, 2.0]) for k in names}, {"time": [0.0, 1.0]})
    shown = {label: [c.name for c in p.curves] for label, p in panels(run_chart(run)).items()}
    force = shown.pop("contact force (kN)")
    assert len(force) == 8
    assert (force[0], force[-1]) == ("wheelset 1, left", "wheelset 32, left")
    assert shown == {
        "bogie acceleration (m/s²)": ["bogie 3"],
        "car body acceleration (m/s²)": ["vehicle 1, car body", "car body 2"],
    }


def test_a_sensor_is_no_body() -> None:
    """What a rail does at a place has a panel of its own, in a response as well."""
    force = ("frequency", [1e8, 2e8], {"units": "N/m"})
    seen = {"units": "m/m", "long_name": "left rail at 3 m: displacement, down", "at": 3.0}
    frf = xr.Dataset(
        {
            "carbody.z": ("frequency", [0.2, 0.1]), "wheelset[1].left.force_z": force,
            "sensor[1].z": ("frequency", [0.5, 0.5], seen),
        },
        {"frequency": [1.0, 2.0]}, {"excitation": "irregularity_z", "title": "response"},
    )  # fmt: skip
    shown = {k: [c.name for c in panel.curves] for k, panel in panels(response_chart(frf)).items()}
    assert shown["|displacement| (m/m)"] == ["car body"]
    assert shown["left rail at 3 m: |displacement| (m/m)"] == ["left rail at 3 m"]
