"""What a simulation compiles, the dearest first: see ``compile_ahead.py``. Who simulates begins at the other end."""

from __future__ import annotations

STEPS = tuple(
    f"drivetrain.{step}"
    for step in (
        "simulation.law_kernels:motion", "simulation.step_kernel:compiled", "effects.flexible_joint:_compute",
        "effects.current_loop:_compute", "simulation.law_kernels:forces", "effects.commanded_motion:_compute",
        "effects.winding_heat:_account", "dynamics.composite:compiled",
    )
)  # fmt: skip
"""The fixed step, and what scenes of a study are made of."""
