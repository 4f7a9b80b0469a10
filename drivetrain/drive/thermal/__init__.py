"""Winding and housing temperature: thermal network, periodic steady state, warm-up."""
