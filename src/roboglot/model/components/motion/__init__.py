"""Interfaces of what moves: base, legs, navigation, docking, gimbal, arm."""
