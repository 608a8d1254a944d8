"""What users call schemes and inputs: for those who ask before anything that computes is loaded."""

from __future__ import annotations

SCHEMES = (
    "aitken", "gauss-seidel", "interface-jacobian", "interface-jacobian-radau-2",
    "interface-jacobian-hermite", "interface-jacobian-conserving-4",
    "interface-jacobian-conserving-6", "iqn-ils", "jacobi", "nepce", "picard",
)  # fmt: skip
"""Keys of `schemes.catalogue.CATALOGUE`, in its order."""
INPUTS = ("constant", "linear", "quadratic")
"""Polynomials that inputs follow between communication points, by degree."""
