"""Winding and housing temperature: the network, one cycle for ever, warming up."""
