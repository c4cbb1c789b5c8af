"""Going somewhere: planning, driving, doors, floors, crowds."""
