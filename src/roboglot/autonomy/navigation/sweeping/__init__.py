"""Sweeping an area: where the lanes lie, how much of them has been driven, and the component that drives them."""
