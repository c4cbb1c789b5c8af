"""Simulated components that move something: base, legs, gimbal, arm, and what stops them."""
