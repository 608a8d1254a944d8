"""Shared libraries of our own C: compilers, platforms, and where what was made is kept."""
