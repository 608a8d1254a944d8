"""FMUs as components: files checked, described, called; each in its own process if wanted."""
