"""The figures of Xu & Lu (2021), from the FMUs."""
