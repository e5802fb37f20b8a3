"""Search for legible layouts: pyribs archives and schedulers with emitters made for workspaces."""
