"""The laws of one drive: motor, gear, friction, heat and amplifier, each standing once."""
