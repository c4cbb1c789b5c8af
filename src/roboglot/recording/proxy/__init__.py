"""Records a robot as a proxy between it and its client: passes every byte on and records the exchanges."""
