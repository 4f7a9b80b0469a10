"""The parts of a study: arm, motions, joints, sheets, and what it wants of jobs."""
