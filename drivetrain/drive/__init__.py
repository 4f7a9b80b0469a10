"""The laws of one drive: motor, gear, friction, heat, amplifier."""
