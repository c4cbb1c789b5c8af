"""Chapters "firmware" and "application": updates from the maker, uploaded packages, installed apps."""
