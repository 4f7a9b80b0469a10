"""Constraints on whole sets of drives: satisfied or not by a set, and bounds for the sets of a node."""
