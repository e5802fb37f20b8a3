"""Tools for every package, without any domain: compiling, files, plug-ins, validation."""
