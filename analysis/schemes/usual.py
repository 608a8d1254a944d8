"""What is taken where nobody says: help tells it, and needs nothing that computes for that."""

from __future__ import annotations

from railcosim.analysis.pair.owner import Owner

USUAL = {
    Owner.TRACK: "gauss-seidel",
    Owner.VEHICLE: "jacobi",
    Owner.MASTER: "interface-jacobian",
}
"""Scheme by the owner of the contact, the usual owner first."""
ASIDE = USUAL | {Owner.VEHICLE: "iqn-ils"}
"""The same where wheels roll on rails that move aside. A vehicle that owns the contacts is given
the rails' rates late, and creep times what a rail gives way in a step is above 1: what does not
iterate grows at any step that anybody would want, and so does what iterates without learning."""
# Stable up to 8 GN/m and, with the contact in the vehicle, up to Hertz at the static load.
STEPS = {Owner.VEHICLE: 2e-5, Owner.TRACK: 1e-4, Owner.MASTER: 2e-5}
SOLVED = 1e-4  # stable at any step: this one for accuracy
AGREED = 1e-4  # of `ASIDE` with the contacts in the vehicle: forces agree at the end of a step
PREDICTED = ("jacobi", "gauss-seidel-linear", "nepce", "interface-jacobian")
"""Schemes that are predicted; all that can be would take twice as long."""
