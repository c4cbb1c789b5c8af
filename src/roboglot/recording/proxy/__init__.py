"""Records a robot from between it and its client: every byte passes, and what it means is noted beside."""
