"""Packs the models as FMUs."""
