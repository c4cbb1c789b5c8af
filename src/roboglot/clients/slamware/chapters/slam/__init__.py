"""Chapter "slam": localization, docks, maps."""
