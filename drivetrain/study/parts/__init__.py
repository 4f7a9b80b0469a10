"""The parts of a study: arm, motions, joints, data sheets, and the options of selections and simulations."""
