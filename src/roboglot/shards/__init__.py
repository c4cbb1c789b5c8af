"""Many worlds on one machine: a warmed-up nursery forks a process (a shard) for each, and a supervisor keeps them up.

A shard is one runtime with one world and its robots. Nothing below this package knows of shards.
"""
