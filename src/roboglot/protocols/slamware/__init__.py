"""Slamtec's Slamware REST API 1.1.0 in front of one robot. One file per chapter of the manual."""
