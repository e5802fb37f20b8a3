"""An import-linter contract: modules of compiled kernels import arrays, the compiler and other kernels only."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import Any

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output

__all__ = ["KernelContract"]


class KernelContract(Contract):
    """Modules that match ``kernels`` import, of our packages, only modules that match ``kernels`` or ``allowed``.

    Names are patterns of :mod:`fnmatch`, so that ``*_kernels`` means every file that ends so. What numba compiles stays
    plain data and arithmetic; an import of a shell is where that ends.
    """

    type_name = "kernels"

    kernels = fields.SetField(subfield=fields.StringField())
    allowed = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Compare the imports of every kernel module with the patterns."""
        wrong = sorted(
            (importer, imported)
            for importer in graph.modules
            if self._matches(importer, self.kernels)
            for imported in graph.find_modules_directly_imported_by(importer)
            if not graph.is_module_squashed(imported)
            and not self._matches(imported, self.kernels)
            and not self._matches(imported, self.allowed)
        )
        return ContractCheck(kept=not wrong, metadata={"wrong": wrong})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Say which import of which kernel module is not allowed."""
        for importer, imported in check.metadata["wrong"]:
            output.print_error(f"{importer} holds kernels and imports {imported}")
        output.new_line()

    @staticmethod
    def _matches(module: str, patterns: Any) -> bool:
        return any(fnmatchcase(module, pattern) for pattern in patterns)
