"""Simulated parts for interaction: speaker, skin, armor, blaster, remote control."""
