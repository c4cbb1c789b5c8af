"""Robot bodies: their descriptions, their hulls in the physics, feet and motions, and how components are fitted."""
