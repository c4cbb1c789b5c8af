"""Chapter "slam": switches, the IMU, explore maps and composite maps."""
