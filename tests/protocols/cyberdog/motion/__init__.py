"""Moving, dancing, climbing, following."""
