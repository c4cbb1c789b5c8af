"""Robot bodies: descriptions, hulls in the physics, feet and motions, and the fitting of components."""
