"""The two-mass oscillator of the co-simulation literature, and where each scheme is stable.

Two masses, each on a spring and a damper to the ground, coupled by a third pair, cut in two ways:

- force/displacement: the right half owns the coupling; it gets a motion and gives a force;
- displacement/displacement: both halves have the coupling inside and get each other's motion.

With the step H as unit of time and both halves alike, a half has the eigenvalue
Lambda = -D + i W, and the coupling is as stiff as a support. The picture shows for each scheme
where in the plane of D and W a step does not make anything grow, as in [1] and [2].

    python examples/two_mass_oscillator.py [PICTURE [POINTS]]

[1] M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, PhD thesis, Kassel, 2012.
[2] B. Schweizer, P. Li, D. Lu, Explicit and implicit cosimulation methods: stability and
    convergence analysis for different solver coupling approaches, J. Comput. Nonlinear Dynam. 10
    (2015) 051007.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

from railcosim.master.component import Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.stability.amplifier import Amplifier
from railcosim.master.system import System

FORCE = (Variable(name="force", unit="N"),)
MOTION = {
    side: (Variable(name=f"{side}_x", unit="m"), Variable(name=f"{side}_v", unit="m/s"))
    for side in ("left", "right")
}


def half(side, k, c, inputs, outputs, B, C=None, D=None):
    """A unit mass on stiffness k and damping c."""
    C = np.eye(2) if C is None else C
    D = np.zeros((len(C), np.shape(B)[1])) if D is None else D
    A = [[0.0, 1.0], [-k, -c]]
    return LinearComponent(side, A=A, B=B, C=C, D=D, inputs=inputs, outputs=outputs)


def force_displacement(k, c, k_c, c_c):
    """Left gets the force of the coupling, which is in the right half."""
    left = half("left", k, c, FORCE, MOTION["left"], [[0.0], [1.0]])
    right = half(
        "right", k + k_c, c + c_c, MOTION["left"], FORCE,
        [[0.0, 0.0], [k_c, c_c]], [[k_c, c_c]], [[-k_c, -c_c]],
    )  # fmt: skip
    return System([left, right], connect_by_name([left, right]))


def displacement_displacement(k, c, k_c, c_c):
    """Both halves have the coupling inside."""
    B = [[0.0, 0.0], [k_c, c_c]]
    left = half("left", k + k_c, c + c_c, MOTION["right"], MOTION["left"], B)
    right = half("right", k + k_c, c + c_c, MOTION["left"], MOTION["right"], B)
    return System([left, right], connect_by_name([left, right]))


COUPLINGS = {
    "force/displacement": force_displacement,
    "displacement/displacement": displacement_displacement,
}
SCHEMES = {
    f"{name}, {inputs}": scheme
    for degree, inputs in enumerate(("constant", "linear", "quadratic"))
    for name, scheme in (
        ("Jacobi", jacobi(degree=degree)),
        ("Gauss-Seidel, left first", gauss_seidel(first="left", degree=degree)),
    )
}


def growth(coupling, scheme, D, W):
    """Spectral radius of a step of length 1 of halves with eigenvalues -D + i W."""
    k, c = D**2 + W**2, 2.0 * D
    return Amplifier(coupling(k, c, k, c), scheme).at(1.0).spectral_radius()


def main(picture="two_mass_oscillator.png", points=13):
    """Draw the regions, and print how far they reach along a damping ratio of one half."""
    D, W = np.linspace(0.0, 0.8, int(points)), np.linspace(0.05, 2.5, int(points))
    colors = ("#0072B2", "#D55E00", "#009E73")
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), sharey=True, layout="constrained")
    for panel, (title, coupling) in zip(axes, COUPLINGS.items(), strict=True):
        for i, (name, scheme) in enumerate(SCHEMES.items()):
            radius = np.array([[growth(coupling, scheme, d, w) for d in D] for w in W])
            style = "--" if name.startswith("Gauss") else "-"
            line = {"colors": colors[i // 2], "linestyles": style}
            panel.contour(D, W, np.log(radius), levels=[0.0], **line)
            panel.plot([], [], color=colors[i // 2], linestyle=style, label=name)
        panel.set(title=title, xlabel="damping D = -Re(Lambda)", xlim=(0.0, 1.2))
        panel.text(
            0.97, 0.03, "stable between a curve\nand the axis of damping, or right of it",
            transform=panel.transAxes, ha="right", color="0.4", fontsize=8,
        )  # fmt: skip
    axes[0].set_ylabel("frequency W = Im(Lambda)")
    axes[1].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    figure.suptitle("Two-mass oscillator: where a step does not let anything grow")
    figure.savefig(picture, dpi=150)
    for title, coupling in COUPLINGS.items():
        for name, scheme in SCHEMES.items():
            low, high = 1e-2, 10.0
            for _ in range(18):  # three digits
                middle = np.sqrt(low * high)
                stable = growth(coupling, scheme, 0.5 * middle, np.sqrt(0.75) * middle) < 1.0
                low, high = (middle, high) if stable else (low, middle)
            print(f"{title}, {name}: stable to |Lambda| H = {low:.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
