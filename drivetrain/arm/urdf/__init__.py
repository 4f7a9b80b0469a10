"""URDF files read: what they say, and the arm that they describe. Writing is in ``export/``."""
