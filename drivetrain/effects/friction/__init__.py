"""Friction at a joint or a shaft: dry, viscous and LuGre friction, a moving belt, a holding brake."""
