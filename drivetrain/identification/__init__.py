"""From a recording to the arm that made it: parameters, how sure they are, and what they explain of unseen data."""
