"""The native runtime: C sources, the resource file they read, and how they are compiled."""
