"""Records with the constants of an arm for the kernels; ``packed.py`` fills them."""

from __future__ import annotations

import numpy as np

MOMENTS = ("mass", "hx", "hy", "hz", "sxx", "syy", "szz", "sxy", "sxz", "syz")

# A link, and its joint on the link before; or a rotor on its carrier. SI units.
LINK = np.dtype(
    [
        (name, np.float64)
        for name in (
            # Place of the joint in the previous frame; the link rotates about z by ``turn q + offset``, translates
            # along it by ``slide q``, and is then rotated by the rotation, which is about x except for a rotor.
            *("px", "py", "pz", "turn", "slide", "offset"),
            *("rxx", "rxy", "rxz", "ryx", "ryy", "ryz", "rzx", "rzy", "rzz"),
            # Body, about the origin of its frame: mass, first moments, second moments.
            *MOMENTS,
            # Of a balanced rotor on the joint's axis: angular momentum per unit rate, inertia times ratio squared.
            *("spin", "rotor_inertia"),
            # Cosine and sine of the angle about z from this frame to the joint's own.
            *("cos_own", "sin_own"),
        )
    ]
)

# A rotor with an own record: the coordinate that it follows, the link that carries it (-1: the base), and whether it is
# balanced. If so, (px, py, pz) of its LINK is its angular momentum per unit rate, in the carrier's frame.
ROTOR = np.dtype([("joint", np.int64), ("carrier", np.int64), ("balanced", np.int64)])
