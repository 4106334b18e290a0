"""Compilation of inner functions: callers take them in whole, so that they need no machine code of their own.

Numba optimises each function as far as it can and turns it into machine code, and each of its callers does so once
more with all that it takes in. For a function that is called from compiled code only, the first is lost time: a third
of all compilation.
"""

from __future__ import annotations

import ctypes
from typing import Any

from numba import _dynfunc
from numba.core import typed_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass

from planarfriction._engine.compiler.numba_compat import need

need(_dynfunc, "make_function")
need(
    JITCodeLibrary,
    "_optimize_final_module",
    "_finalize_final_module",
    "_finalize_dynamic_globals",
)
need(typed_passes, "NativeLowering")

_NEEDLESS = {
    "WithLifting",
    "InlineClosureLikes",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "RewriteSemanticConstants",
    "InlineOverloads",
    "NopythonRewrites",
    "NoPythonSupportedFeatureValidation",
    "DumpParforDiagnostics",
}
"""Passes of Numba for features that inner functions lack: closures, `with`, expressions of arrays, parallel loops."""


_REFUSE = ctypes.cast(ctypes.pythonapi.PyErr_BadArgument, ctypes.c_void_p).value
"""Address of a function of Python that raises TypeError: there is nothing else that Python could call."""


class _Linked(JITCodeLibrary):
    """Code that is only ever linked into the code of callers: simplified, with its own inner functions in place."""

    def _optimize_final_module(self) -> None:
        made = self._codegen._module_pass_manager(
            opt=0, loop_vectorize=False, slp_vectorize=False, cost="cheap"
        )
        # Numba before 0.62 has no builder.
        passes, *builder = made if isinstance(made, tuple) else (made,)
        passes.run(self._final_module, *builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(typed_passes.NativeLowering):
    """Pass that makes linked code, and a key by which callers find it in place of a function for Python."""

    _name = "lowering of inner functions"

    def run_pass(self, state: Any) -> bool:
        state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        state.library.finalize()
        made = state.cr.fndesc
        key = _dynfunc.make_function(
            made.lookup_module(),
            made.qualname,
            "",
            _REFUSE,
            state.cr.env,
            (state.library,),
        )
        state.targetctx.insert_user_function(key, made, [state.library])
        state.cr = state.cr._replace(cfunc=key)
        return True


class Inner(CompilerBase):
    """Compiler of inner functions."""

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes without the needless ones, and with another lowering."""
        passes = PassManager("inner")
        for each, words in DefaultPassBuilder.define_nopython_pipeline(
            self.state
        ).passes:
            if each.__name__ not in _NEEDLESS:
                passes.add_pass(
                    _Lowering if each is typed_passes.NativeLowering else each, words
                )
        passes.finalize()
        return [passes]
