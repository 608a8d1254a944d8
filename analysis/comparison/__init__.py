"""Parts of a comparison of coupled FMUs with one monolithic system."""
