"""The old place of ``core/packed.py``, for the simulation."""

from drivetrain.dynamics.core.packed import followers as followers
from drivetrain.dynamics.core.packed import link_frames as link_frames
from drivetrain.dynamics.core.packed import packed as packed
