"""Chapter "motion": motions by number, their results, and plain names of walks and figures."""
