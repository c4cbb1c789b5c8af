"""Simulated components for motion: base, legs, gimbal, arm, and their stops."""
