"""People in the world: what they do, how they walk, and how their bodies are posed."""
