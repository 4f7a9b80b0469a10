"""The loops of a joint's servo: the axis, the design, compiled stages held over a step."""
