"""What the kernels know of an arm, as records with named fields; ``packed.py`` fills them."""

from __future__ import annotations

import numpy as np

# A link, and its joint on the link before; or a rotor on its carrier. SI units.
LINK = np.dtype(
    [
        (name, np.float64)
        for name in (
            # Place of the joint in the frame before: a revolute joint turns by Rx(alpha) Rz(q + offset).
            *("cos_alpha", "sin_alpha", "px", "py", "pz", "offset"),
            # Body, about the origin of its frame: mass, first moments, second moments.
            *("mass", "hx", "hy", "hz", "sxx", "syy", "szz", "sxy", "sxz", "syz"),
            # Of a balanced rotor on the joint's axis: angular momentum for a unit rate, inertia times ratio squared.
            *("spin", "rotor_inertia"),
            # Turn and slide for a unit of q; cosine and sine from the recursion's frame to the joint's own.
            *("turn", "slide", "cos_own", "sin_own"),
            # Rotation into the frame before with the joint at zero, row by row.
            *("rxx", "rxy", "rxz", "ryx", "ryy", "ryz", "rzx", "rzy", "rzz"),
        )
    ]
)

# A rotor that needs a pass of its own: the coordinate that it turns with, the link that it rides on (-1: the base), and
# whether it is balanced. Then (px, py, pz) of its LINK is its angular momentum for a unit rate, in the carrier's frame.
ROTOR = np.dtype([("joint", np.int64), ("carrier", np.int64), ("balanced", np.int64)])
