"""The member whose face or voice is expected: the same person under a new name, and missed once removed."""

from __future__ import annotations

from roboglot.model.components.interaction.members import Members
from roboglot.model.robot import Robot


class ExpectedMember:
    """Remembers a member by number, which a change of the name keeps."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._id: int | None = None

    def expect(self, name: str) -> None:
        """Expect this member. Raises NotFound."""
        self._id = self._robot[Members].get(name).id

    def clear(self) -> None:
        """Expect no member any more."""
        self._id = None

    @property
    def name(self) -> str:
        """The present name; "" if no member is expected, or the member was removed."""
        if self._id is None:
            return ""
        return next((member.name for member in self._robot[Members].all() if member.id == self._id), "")

    @property
    def removed(self) -> bool:
        """True if the expected member was removed."""
        return self._id is not None and not self.name
