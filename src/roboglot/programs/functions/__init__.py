"""What programs can call: one file per group of the manual's ability set (chapter 4.4). Knows robots, no process."""
