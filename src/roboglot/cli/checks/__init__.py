"""Checks of `roboglot doctor` besides packages: listening ports, and their reach."""
