"""Chapter "delivery", and days of it."""
