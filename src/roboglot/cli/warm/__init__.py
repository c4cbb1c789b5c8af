"""Commands that start robots of their own, forked from a process that has imported everything."""
