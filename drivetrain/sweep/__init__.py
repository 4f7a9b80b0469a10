"""Many studies that differ in some entries, evaluated on all cores or a cluster, with results in shards (files)."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.sweep.points import read_sweep
    from drivetrain.sweep.run import run_sweep
    from drivetrain.sweep.shards import read_results

__getattr__, __dir__ = shown(__name__)
