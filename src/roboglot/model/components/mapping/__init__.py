"""Interfaces of maps: localization, mapping, annotations, places, floors, saved maps."""
