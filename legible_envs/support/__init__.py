"""What every package may use and what knows of no kitchen, table or person: compiling, files, plug-ins, validation."""
