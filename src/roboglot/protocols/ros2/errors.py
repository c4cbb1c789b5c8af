"""Levels of the model's errors in ``/rosout``, as topics have no answers."""

from roboglot.protocols.ros_commands import level_of as level_of
