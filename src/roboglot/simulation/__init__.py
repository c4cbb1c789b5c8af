"""The simulated world and the robots in it. Knows the model's interfaces; no protocol, no database, no autonomy."""
