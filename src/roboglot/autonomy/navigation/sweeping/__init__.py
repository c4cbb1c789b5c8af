"""Sweeping an area: the lanes, their swept share, and the component that drives them."""
