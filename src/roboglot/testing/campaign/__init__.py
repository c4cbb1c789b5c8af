"""Campaigns: every scenario with many seeds, on all cores or a Ray cluster, into one table and one report."""
