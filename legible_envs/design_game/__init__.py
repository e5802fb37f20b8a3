"""Design as a game: an agent edits a layout, and is paid by how much more legible it becomes."""
