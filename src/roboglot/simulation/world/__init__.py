"""The world itself: its description, its time and physics, and what can be seen in it. Knows no protocol."""
