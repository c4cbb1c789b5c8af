"""A real robot behind Slamtec's Slamware REST API. Knows the client and the model, no door."""
