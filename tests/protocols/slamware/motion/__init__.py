"""Chapter "motion": actions, tags, tracks."""
