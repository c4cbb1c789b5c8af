"""Typer's commands and groups with suggestions for mistyped options and commands that are nearer than Typer's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from typer.core import TyperCommand, TyperGroup
from typer.exceptions import TyperException

from roboglot.spelling import instead, nearest

if TYPE_CHECKING:
    from typer import _click


class Command(TyperCommand):
    """Command that suggests the option that was probably meant, or none."""

    def parse_args(self, ctx: _click.Context, args: list[str]) -> list[str]:
        """Parse the words of the command line. Raises TyperException."""
        try:
            return super().parse_args(ctx, args)
        except TyperException as error:
            if option := getattr(error, "option_name", ""):
                known = [name for parameter in self.params for name in (*parameter.opts, *parameter.secondary_opts)]
                vars(error)["possibilities"] = [near] if (near := nearest(option, known)) else []
            raise


class Group(TyperGroup):
    """Command with subcommands that suggests the one that was probably meant, or lists all."""

    def resolve_command(
        self, ctx: _click.Context, args: list[str]
    ) -> tuple[str | None, _click.Command | None, list[str]]:
        """Find the subcommand. Raises TyperException."""
        if args[0] not in self.commands and not args[0].startswith("-"):
            ctx.fail(f"No such command {args[0]!r}{instead(args[0], self.commands)}")
        return super().resolve_command(ctx, args)
