"""The compiled equations of motion of a scene, on records: assembly of the linear system, friction, Jacobian."""
