"""Checks of `roboglot doctor` besides packages: listening ports, and what is open to whom."""
