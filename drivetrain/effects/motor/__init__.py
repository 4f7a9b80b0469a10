"""Effects of the motor: winding, current and its control, supply, heat, cogging and rotor inertia."""
