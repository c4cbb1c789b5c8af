"""Draws what cameras see: scenes as coloured quads, turned into pictures by the raster kernels."""
