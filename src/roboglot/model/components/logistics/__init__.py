"""Interfaces of carrying: delivery, cargo, jack, lift, traffic radio."""
