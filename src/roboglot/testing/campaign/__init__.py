"""Campaigns: every scenario with many seeds, on all cores, into one table and one report."""
