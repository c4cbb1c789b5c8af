"""Chapter "multi-floor": floors, elevators, tours and ways along the virtual tracks."""
