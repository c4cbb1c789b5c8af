"""The interfaces of what a robot can have, one a file. Simulation, drivers and autonomy implement them."""
