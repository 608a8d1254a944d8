"""Figures 4 to 6: car body and bogies under a unit force on wheelset 4, rigid and flexible track.

Also under a second normalisation: irregularity under wheelset 4 alone, per N of its equivalent
force 2 k_H A. On rigid track both are the same system.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Mark, Panel

from .figure import FORCE, IRREGULARITY, WHEEL, Figure, curves_dataset, peak, sizes
from .finding import Finding
from .laboratory import K_H, Laboratory

BODIES = {
    4: ("car body", "vehicle.carbody"),
    5: ("front bogie", "vehicle.bogie[1]"),
    6: ("rear bogie", "vehicle.bogie[2]"),
}
SAME = 0.05  # relative: a reader cannot see less on the paper's logarithmic axes
SILENT = 1e-6  # of the bounce in m: a pitch (rad) below is rounding
Curves = dict[tuple[str, str], list[FloatArray]]  # by track and excitation: bounce, pitch, wheel


def figure(lab: Laboratory, number: int) -> Figure:
    """Figure 4, 5 or 6."""
    name, body = BODIES[number]
    frequency = lab.frequencies(0.1, 200.0)
    omega = 2 * np.pi * frequency
    outputs = [f"{body}.z", f"{body}.pitch", WHEEL]
    found: Curves = {}
    for track, system in (("rigid", lab.rigid()(omega)), ("flexible", lab.coupled()(omega))):
        found[track, "force"] = sizes(system, FORCE, lab.positions, outputs)
        per_metre = sizes(system, IRREGULARITY, lab.positions, outputs)
        found[track, "irregularity"] = [values / (2 * K_H) for values in per_metre]
    findings = (*_frequencies(number, name, frequency, found), *_lower(number, frequency, found))
    return Figure(
        number=number,
        title=f"Response of the {name} to wheelset 4: rigid and flexible track",
        text=_text(number, name, found, frequency),
        chart=_chart(f"Figure {number}: {name}", frequency, found, with_wheel=number == 4),
        data=_data(frequency, found),
        findings=findings,
    )


def _text(number: int, name: str, found: Curves, frequency: FloatArray) -> str:
    force, alike = (_ratio(frequency, found, e) for e in ("force", "irregularity"))
    seen = (
        f"A unit force moves the {name} {force:.1f} times as far at its first peak when the track "
        "is flexible: the support under the wheel is softer. Under irregularity the peak is the "
        f"same (ratio {alike:.3f}), because the wheel follows the surface on either track. "
    )
    if number == 5:
        return seen + (
            "At higher frequencies waves in the rail reach the front bogie, which on rigid track "
            "only the car body's motion does, and make several peaks."
        )
    return seen + "What flexible track lowers is the response above the wheel's resonance on it."


FIGURES = {number: partial(figure, number=number) for number in BODIES}


def _ratio(frequency: FloatArray, found: Curves, excitation: str) -> float:
    """Flexible to rigid at the rigid track's first peak of bounce."""
    rigid, flexible = (found[track, excitation][0] for track in ("rigid", "flexible"))
    low = frequency < 2
    return float(flexible[low].max() / rigid[low].max())


def _frequencies(number: int, name: str, frequency: FloatArray, found: Curves) -> list[Finding]:
    bounce, pitch, wheel = found["rigid", "force"]
    soft_bounce, soft_pitch, soft_wheel = found["flexible", "force"]

    def row(quantity: str, paper: float, values: FloatArray, window: tuple[float, float],
            note: str = "") -> Finding:  # fmt: skip
        top = peak(frequency, values, *window)
        if values.max() < SILENT * bounce.max():
            ours: float | str = "no response"
        else:
            ours = "no peak" if np.isnan(top) else top
        agrees = not isinstance(ours, str) and abs(ours / paper - 1) < SAME
        return Finding(
            figure=str(number), quantity=quantity, paper=paper, ours=ours, unit="Hz",
            note="" if agrees else note, agrees=agrees,
        )  # fmt: skip

    if number == 4:
        return [
            row("car body bounce, rigid track", 0.7, bounce, (0.4, 1.2)),
            row("car body bounce, flexible track", 0.7, soft_bounce, (0.4, 1.2)),
            row("car body pitch, rigid track", 0.93, pitch, (0.5, 1.4)),
            row("car body pitch, flexible track", 0.93, soft_pitch, (0.5, 1.4)),
            row("wheel on contact spring, rigid track", 93.5, wheel, (50, 150)),
            row("wheel on track, f_w", 32.7, soft_wheel, (20, 60)),
        ]
    damped = (
        "not reproducible: the primary dampers of Table A1 make bogie pitch critically damped "
        "(ratio about 1.03, undamped 6.39 Hz); nothing is tuned to it"
    )
    centred = (
        "our secondary suspension is vertical and acts at the bogie's centre, so the car body's "
        "pitch moves the bogies up and down but does not pitch them"
    )
    loaded = "the paper gives one number for both bogies; the loaded one peaks lower"
    return [
        row(f"{name} vertical, first peak", 0.74, soft_bounce, (0.4, 1.2), loaded),
        row(f"{name} pitch, first peak", 0.93, soft_pitch, (0.5, 1.4), centred),
        row(f"{name} pitch, second peak, rigid track", 6.2, pitch, (2.5, 12), damped),
        row(f"{name} pitch, second peak, flexible track", 6.2, soft_pitch, (2.5, 12), damped),
    ]


def _lower(number: int, frequency: FloatArray, found: Curves) -> list[Finding]:
    """The statement that responses are lower on flexible track, under both normalisations."""
    above = frequency > 60
    waves = "; waves in the rail reach the front bogie" if number == 5 else ""
    rows = []
    for excitation, note in (
        ("force", "a unit force moves a softer support more" + waves),
        (
            "irregularity",
            "irregularity under wheelset 4, per N of its equivalent force 2 k_H A: below the "
            "wheel's resonance the wheel follows the surface on either track" + waves,
        ),
    ):
        ratio = _ratio(frequency, found, excitation)
        rigid, flexible = (found[track, excitation][0] for track in ("rigid", "flexible"))
        high = float(np.median(flexible[above] / rigid[above]))
        rows += [
            Finding(
                figure=str(number),
                quantity=f"bounce, flexible over rigid at the first peak, {excitation}",
                paper="lower than 1", ours=ratio, unit="1", agrees=ratio < 0.99, note=note,
            ),
            Finding(
                figure=str(number),
                quantity=f"bounce, flexible over rigid, median 60-200 Hz, {excitation}",
                paper="lower than 1", ours=high, unit="1", agrees=high < 0.99, note=note,
            ),
        ]  # fmt: skip
    return rows


def _chart(title: str, frequency: FloatArray, found: Curves, *, with_wheel: bool) -> Chart:
    names = ["bounce (m)", "pitch (rad)", "wheelset 4 (m)"][: 3 if with_wheel else 2]
    labels = {
        "force": "|response| per N on wheelset 4",
        "irregularity": "|response| per N of 2 k_H A",
    }
    rows = []
    for excitation, label in labels.items():
        both = [
            v for track in ("rigid", "flexible") for v in found[track, excitation][: len(names)]
        ]
        top = 3 * max(float(v.max()) for v in both)
        rows.append(
            tuple(
                Panel(
                    x_label="frequency (Hz)",
                    y_label=label,
                    curves=tuple(
                        Curve(name=name, x=frequency, y=values)
                        for name, values in zip(names, found[track, excitation], strict=False)
                    ),
                    marks=_marks(with_wheel, track),
                    x_log=True,
                    y_log=True,
                    x_range=(0.1, 200.0),
                    y_range=(1e-6 * top, top),
                    title=f"{track} track",
                )
                for track in ("rigid", "flexible")
            )
        )
    return Chart(title=title, rows=tuple(rows), share_x=True)


def _marks(with_wheel: bool, track: str) -> tuple[Mark, ...]:
    """The paper's resonances."""
    if not with_wheel:
        return (Mark(label="0.74", x=0.74), Mark(label="6.2", x=6.2))
    last = 93.5 if track == "rigid" else 32.7
    return (Mark(label="0.7", x=0.7), Mark(label="0.93", x=0.93), Mark(label=f"{last}", x=last))


def _data(frequency: FloatArray, found: Curves) -> xr.Dataset:
    names = (("bounce", "m/N"), ("pitch", "rad/N"), ("wheelset_4", "m/N"))
    curves = {
        f"{name}_{track}_{excitation}": (values, unit)
        for (track, excitation), columns in found.items()
        for (name, unit), values in zip(names, columns, strict=True)
    }
    return curves_dataset(frequency, curves, contact_stiffness=K_H)
