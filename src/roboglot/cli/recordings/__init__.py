"""Commands about recordings: record, rerun, replay, compare."""
