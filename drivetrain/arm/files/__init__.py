"""Arms from files: URDF, xacro, MJCF, SDF, Denavit-Hartenberg tables."""
