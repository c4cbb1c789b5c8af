"""The model's components on the simulated body, one per file, named as in ``model.components``.

``control(seconds)`` runs before the physics of a tick, ``sense(stamp, seconds)`` after it.
"""
