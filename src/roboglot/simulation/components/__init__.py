"""The model's components over the simulated body, one a file, named as in ``model.components``.

``control(seconds)`` runs before the physics of a tick, ``sense(stamp, seconds)`` after it.
"""
