"""The world itself: description, time, physics and lines of sight. Knows no protocol."""
