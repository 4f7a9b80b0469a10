"""What the kernels know of an arm, as records with named fields; ``packed.py`` fills them."""

from __future__ import annotations

import numpy as np

MOMENTS = ("mass", "hx", "hy", "hz", "sxx", "syy", "szz", "sxy", "sxz", "syz")

# A link, and its joint on the link before; or a rotor on its carrier. SI units.
LINK = np.dtype(
    [
        (name, np.float64)
        for name in (
            # Place of the joint in the frame before; there the link turns about z by ``turn q + offset``, slides along
            # it by ``slide q``, and is then turned by the rotation. That of a revolute joint is one about x.
            *("px", "py", "pz", "turn", "slide", "offset"),
            *("rxx", "rxy", "rxz", "ryx", "ryy", "ryz", "rzx", "rzy", "rzz"),
            # Body, about the origin of its frame: mass, first moments, second moments.
            *MOMENTS,
            # Of a balanced rotor on the joint's axis: angular momentum for a unit rate, inertia times ratio squared.
            *("spin", "rotor_inertia"),
            # Cosine and sine of the turn about z from this frame to the joint's own.
            *("cos_own", "sin_own"),
        )
    ]
)

# A rotor that needs a pass of its own: the coordinate that it turns with, the link that it rides on (-1: the base), and
# whether it is balanced. Then (px, py, pz) of its LINK is its angular momentum for a unit rate, in the carrier's frame.
ROTOR = np.dtype([("joint", np.int64), ("carrier", np.int64), ("balanced", np.int64)])
