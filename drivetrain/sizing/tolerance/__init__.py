"""Arms as they may be built: probabilities, what they come from, sets that satisfy them."""
