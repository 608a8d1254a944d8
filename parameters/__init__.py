"""Declared quantities: default, unit, range and source of every parameter; TOML in and out."""

from .quantity import ArgumentError, ParameterError, ParameterSet, quantity, switch
from .toml_file import read_toml, write_toml
from .usual import UnusualWarning, Usual

__all__ = [
    "ArgumentError",
    "ParameterError",
    "ParameterSet",
    "UnusualWarning",
    "Usual",
    "quantity",
    "read_toml",
    "switch",
    "write_toml",
]
