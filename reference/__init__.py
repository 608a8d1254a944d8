"""The monolithic solution that every coupled result is held against."""
