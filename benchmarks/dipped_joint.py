"""Impact at a dipped joint: P1 and P2 of a run beside the formulas of Jenkins et al.

The formulas take the track for one mass on a spring and a damper: those of the rail's receptance,
by finite elements, at rest and at the frequency of P2; and for P1 for a free mass, that of the rail
at the frequency of P1. Orders of magnitude: the joint's ends are straight in them, the track knows
no other frequency, and contacts are linear.

    python benchmarks/dipped_joint.py [PICTURE]

References
----------
Jenkins, H. H. et al. (1974), The effect of track and vehicle parameters on wheel/rail vertical
dynamic forces, Railway Eng. J. 3(1), 2-16.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.kept_fmus import fmus_of_pair
from railcosim.analysis.response.track_receptance import track_receptance
from railcosim.analysis.run import run
from railcosim.fmus.start import contact_defaults
from railcosim.plots.chart import Chart, Curve, Panel
from railcosim.plots.picture import save_picture
from railcosim.track.irregularity import Joint
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

JOINT = Joint(depth=2.5e-3, length=1.0, at=21.25)  # m; 2 alpha = 0.02 rad; between two railseats
SPEEDS = (60.0, 100.0, 140.0)  # km/h
STEP, FAR = 2e-5, 1.5  # s; m behind the kink
P1_WITHIN = 2e-3  # s behind the kink
ROUNDS = 20

console = Console(width=110)


def stiffness_of(track: Track, omega: float) -> complex:
    """Dynamic stiffness of the rail at mid-span, both loaded alike, N/m."""
    found = track_receptance(
        track, np.array([omega / (2 * np.pi)]), position=str(JOINT.at), both_rails=True
    )
    return complex(1 / found["receptance"].values[0])


def jenkins(vehicle: Vehicle, track: Track, speed: float) -> tuple[float, float]:
    """P1 and P2, N, at a speed, m/s."""
    P0 = vehicle.wheel_load
    M_u, blow = vehicle.wheelset.mass / 2, JOINT.angle * speed
    K_H = float(np.mean(contact_defaults(vehicle).k_H))
    K_t = stiffness_of(track, 2 * np.pi * 1.0).real
    M_t, C_t = 0.0, 0.0
    for _ in range(ROUNDS):
        omega = np.sqrt(K_t / (M_u + M_t))
        D = stiffness_of(track, omega)
        M_t, C_t = max((K_t - D.real) / omega**2, 0.0), D.imag / omega
    M_e = 100.0
    for _ in range(ROUNDS):
        omega = np.sqrt(K_H * (1 / M_e + 1 / M_u))
        M_e = (M_e + max(-stiffness_of(track, omega).real / omega**2, 1.0)) / 2
    P1 = P0 + blow * np.sqrt(K_H * M_e / (1 + M_e / M_u))
    damped = 1 - np.pi * C_t / (4 * np.sqrt(K_t * (M_u + M_t)))
    P2 = P0 + blow * np.sqrt(M_u / (M_u + M_t)) * damped * np.sqrt(K_t * M_u)
    console.print(
        f"M_u {M_u:.0f} kg, K_t {K_t / 1e6:.1f} MN/m, M_t {M_t:.0f} kg, "
        f"C_t {C_t / 1e3:.1f} kN s/m, M_e {M_e:.0f} kg, K_H {K_H / 1e9:.2f} GN/m"
    )
    return float(P1), float(P2)


def main() -> None:
    """Print the table, and draw the forces."""
    vehicle, track = Vehicle(), Track()
    table = Table(title="At a dipped joint of 0.02 rad, kN")
    for column in ("km/h", "P1, run", "P1, Jenkins", "P2, run", "P2, Jenkins"):
        table.add_column(column, justify="right")
    curves = []
    with fmus_of_pair(vehicle, track) as made:
        for kmh in SPEEDS:
            v = kmh / 3.6
            ours = run(
                made.files["Vehicle"], made.files["TrackWithContact"], speed=v, step=STEP,
                time=round((JOINT.at + FAR - 18.5) / v, 3), irregularity="none", defects=[JOINT],
            )  # fmt: skip
            place = ours["wheelset[1].position"].values - JOINT.at
            force = ours["wheelset[1].left.force_z"].values / 1e3
            since = place / v
            P1 = force[(since > 0) & (since < P1_WITHIN)].max()
            P2 = force[since > P1_WITHIN].max()
            theirs = jenkins(vehicle, track, v)
            table.add_row(
                f"{kmh:g}", f"{P1:.0f}", f"{theirs[0] / 1e3:.0f}", f"{P2:.0f}",
                f"{theirs[1] / 1e3:.0f}",
            )  # fmt: skip
            near = np.abs(place) < 1.2
            curves.append(Curve(name=f"{kmh:g} km/h", x=place[near], y=force[near]))
    console.print(table)
    panel = Panel(
        x_label="behind the joint (m)", y_label="contact force, left (kN)", curves=tuple(curves)
    )
    picture = Path(sys.argv[1] if len(sys.argv) > 1 else "joint.png")
    title = "First wheelset over a dipped joint, 2.5 mm over 1 m"
    save_picture(Chart(title=title, rows=((panel,),)), picture)
    console.print(str(picture))


if __name__ == "__main__":
    main()
