"""What resists a joint or a shaft: dry, viscous and LuGre friction, a belt, a brake."""
