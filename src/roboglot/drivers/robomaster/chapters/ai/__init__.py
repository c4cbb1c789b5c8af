"""The AI chapter: visual detection, and its values in the model's terms."""
