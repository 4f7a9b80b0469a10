"""The best sets of drives for the whole arm, with a proof."""
