"""Following people and things around what stands between."""
