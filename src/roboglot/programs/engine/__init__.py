"""Runs programs in confined processes: launching, messages, limits, the journal. Knows no robot."""
