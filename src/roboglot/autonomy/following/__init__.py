"""Following people and things around obstacles."""
