"""Chapter "slam": localization, mapping, docks, maps in memory and composite maps."""
