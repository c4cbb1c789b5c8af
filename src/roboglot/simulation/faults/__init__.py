"""Fault injection: kinds of faults and their lifecycle, acting through the physics."""
