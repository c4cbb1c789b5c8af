"""Fault injection: the kinds of faults and their life, through the same physics that would cause them."""
