"""Control of the robots of a running ``roboglot up``: who moves them, stop, start again."""
