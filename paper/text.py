"""Numbers the paper prints in its text, beside the figures: eqs 18 and 19."""

from __future__ import annotations

import numpy as np

from railcosim.mechanics.law import hertz_coefficient, tangent_stiffness

from .finding import Finding
from .laboratory import K_H, Laboratory

FORCE = 79e3  # N, the paper's static wheel load
COMPRESSION = 2e-3  # m, "less than 2 mm"


def findings(lab: Laboratory) -> list[Finding]:
    """Contact stiffness by Hertz, and the wheel on its contact spring."""
    c = lab.vehicle.contact
    C = hertz_coefficient(
        young_modulus=c.young_modulus,
        poisson_ratio=c.poisson_ratio,
        wheel_radius=lab.vehicle.wheelset.radius,
        rail_radius=c.rail_radius,
    )
    coefficient = 1.5 * C ** (2 / 3)
    at_load = tangent_stiffness(C, FORCE)
    dynamic = 1.5 * C * np.sqrt(COMPRESSION)
    wheel = np.sqrt(K_H / (lab.vehicle.wheelset.mass / 2)) / (2 * np.pi)
    return [
        Finding(figure="text", quantity="eq. 18: k_H / F^(1/3)", paper=3.1e7, ours=coefficient,
                unit="N^(2/3)/m", agrees=abs(coefficient / 3.1e7 - 1) < 0.05),
        Finding(figure="text", quantity="eq. 18: k_H at 79 kN", paper=1.3, ours=at_load / 1e9,
                unit="GN/m", agrees=abs(at_load / 1.3e9 - 1) < 0.05),
        Finding(figure="text", quantity="eq. 18: k_H at 2 mm of compression", paper=4.6,
                ours=float(dynamic) / 1e9, unit="GN/m", agrees=False,
                note="not reproducible: the tangent at 2 mm is higher; 4.6 GN/m is the tangent at "
                f"{1e3 * (4.6e9 / (1.5 * C)) ** 2:.2f} mm"),
        Finding(figure="text", quantity="eq. 19: wheel on its contact spring, 0.3 GN/m", paper=95.1,
                ours=float(wheel), unit="Hz", agrees=abs(wheel / 95.1 - 1) < 0.001),
        Finding(figure="text", quantity="static load of a wheel", paper=79.0,
                ours=lab.vehicle.wheel_load / 1e3, unit="kN",
                agrees=abs(lab.vehicle.wheel_load / 79e3 - 1) < 0.01),
    ]  # fmt: skip
