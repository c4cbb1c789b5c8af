"""Chapter "motion": actions and how they are created, watched and ended."""
