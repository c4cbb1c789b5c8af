"""A real CyberDog 2 behind its app protocol. Knows the client and the model, no door."""
