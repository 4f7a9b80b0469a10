"""What commands: the motion, loops of position and speed, computed torque, and the encoder that they see."""
