"""Simulated parts that people meet: speaker, skin, armor, blaster, remote control."""
