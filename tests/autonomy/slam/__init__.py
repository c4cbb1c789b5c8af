"""Localization and mapping."""
