"""Compilation of entry points: all inner code is linked once and optimised once.

Numba simplifies each function, then each module at its lowest level, to drop counts of references, and then optimises
it. Inner functions here count none, so that one pass does.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
from numba.core import typed_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass

from planarfriction._engine.compiler.inlining import Light, called, code_of
from planarfriction._engine.compiler.numba_compat import need

need(
    JITCodeLibrary,
    "_optimize_functions",
    "add_ir_module",
    "_optimize_final_module",
    "_finalize_final_module",
)
need(llvm, "create_pipeline_tuning_options", "create_pass_builder")


class _Whole(JITCodeLibrary):
    """Code of an entry point with all that it calls."""

    loops = True
    """True for loops that are worth vector instructions; without, the code is made in a third of the time."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Link, optimise, and make machine code."""
        self._raise_if_finalized()
        for library in called(self):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(code_of(library), preserve=True)
        self._optimize_final_module()
        self._finalize_final_module()

    def _optimize_final_module(self) -> None:
        options = llvm.create_pipeline_tuning_options(3 if self.loops else 2)
        options.loop_vectorization = self.loops
        # Pairs of numbers from straight code wait for each other: a published scene takes 1.5 times as long.
        options.slp_vectorization = False
        options.loop_unrolling = self.loops
        options.inlining_threshold = 275 if self.loops else 225
        builder = llvm.create_pass_builder(self._codegen._tm, options)
        passes = builder.getModulePassManager()
        # Entry points that Python calls do count references to arrays.
        passes.add_refprune_pass()
        passes.run(self._final_module, builder)


class _Wide(_Whole):
    """Code whose loops use whole vector registers.

    LLVM uses half of those of Intel processors, since the first with 512 bits lower their clock for whole ones. Later
    ones, which know half precision, do not.
    """

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code with the width of its vectors."""
        if "+avx512fp16" in self._codegen._tm_features.split(","):
            for function in ir_module.functions:
                set.add(function.attributes, '"prefer-vector-width"="512"')
        super().add_ir_module(ir_module)


class _Short(_Whole):
    loops = False


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(typed_passes.NativeLowering):
    _name = "lowering of entry points"
    library: Any = _Whole

    def run_pass(self, state: Any) -> bool:
        state.library = self.library(
            state.targetctx.codegen(), state.func_id.func_qualname
        )
        state.library.enable_object_caching()
        return super().run_pass(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class _WideLowering(_Lowering):
    _name = "lowering of entry points with long loops"
    library = _Wide


@register_pass(mutates_CFG=True, analysis_only=False)
class _ShortLowering(_Lowering):
    _name = "lowering of sequential entry points"
    library = _Short


class Entry(CompilerBase):
    """Compiler of entry points."""

    lowering: Any = _Lowering

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes with another lowering."""
        passes = Light("entry")
        for each, words in DefaultPassBuilder.define_nopython_pipeline(
            self.state
        ).passes:
            lowering = each is typed_passes.NativeLowering
            passes.add_pass(self.lowering if lowering else each, words)
        passes.finalize()
        return [passes]


class Wide(Entry):
    """Compiler of entry points whose time goes into loops over cells with long bodies."""

    lowering = _WideLowering


class Sequential(Entry):
    """Compiler of entry points that have no loop over cells of their own."""

    lowering = _ShortLowering
