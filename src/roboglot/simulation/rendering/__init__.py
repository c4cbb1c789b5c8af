"""Drawing for cameras: scenes of coloured quads, turned into pictures by the raster kernels."""
