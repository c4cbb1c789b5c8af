"""Chapter "artifact": points of interest, virtual lines and areas."""
