"""The doors: one folder per vendor protocol. A door sees one ``Robot`` and nothing else of ours."""
