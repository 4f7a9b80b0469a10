"""The compiled equations of motion of a scene, on records: one system a step."""
