"""Component interfaces, one per file. Simulation, drivers and autonomy implement them."""
