"""Control: commanded motion, position and speed loops, computed torque, and the encoder that they read."""
