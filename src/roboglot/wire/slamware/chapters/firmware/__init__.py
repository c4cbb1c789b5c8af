"""Chapters "firmware" and "application": offers, uploaded packages, Android apps."""
