"""Compilation of inner functions: callers take them in whole, so that they need no machine code of their own.

Numba optimises each function as far as it can and turns it into machine code, and each of its callers does so once
more with all that it takes in. For a function that is called from compiled code only, the first is lost time: a third
of all compilation. Here entry points link all inner functions that they reach, each once, and optimise the whole.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite.binding import Linkage
from numba import _dynfunc
from numba.core import (
    compiler_machinery,
    event,
    postproc,
    transforms,
    typed_passes,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass

from planarfriction._engine.compiler.numba_compat import need

need(_dynfunc, "make_function")
need(
    JITCodeLibrary,
    "_optimize_functions",
    "_get_module_for_linking",
    "_finalize_dynamic_globals",
)
need(compiler_machinery, "_pass_registry")
need(PassManager, "_runPass")
need(postproc, "VariableLifetime")
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
    "IRProcessing",
    "IRLegalization",
}
"""Passes of Numba for features that inner functions lack: closures, `with`, expressions of arrays, parallel loops.

The last one notes where variables end, to release what they hold: nothing here.
"""


_REFUSE = ctypes.cast(ctypes.pythonapi.PyErr_BadArgument, ctypes.c_void_p).value
"""Address of a function of Python that raises TypeError: there is nothing else that Python could call."""


class Linked(JITCodeLibrary):
    """Code that is only ever linked into the code of callers, as it was lowered: they optimise all of it once."""

    _alone: Any = None

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Leave the code as it is, without the code of the functions that it calls."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def alone(self) -> Any:
        """Return the code of this function without those that it calls, for callers that link these too."""
        if self._alone is None:
            self._alone = self._final_module.clone()
            for function in self._alone.functions:
                if not function.is_declaration and function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"
        return self._alone

    def _get_module_for_linking(self) -> Any:
        """Return the code of this function with all that it calls, for callers that Numba compiles by itself."""
        if self._shared_module is None:
            whole = self.alone().clone()
            for library in called(self):
                whole.link_in(code_of(library), preserve=True)
            self._shared_module = whole
        return self._shared_module


def called(library: Any) -> list[Any]:
    """Return the libraries that one calls, and all that inner ones among them call, callers first.

    LLVM drops a function that nothing calls yet when it is linked, hence the order.
    """
    seen: set[Any] = set()
    order: list[Any] = []

    def visit(one: Any) -> None:
        if one in seen:
            return
        seen.add(one)
        for each in one._linking_libraries if isinstance(one, Linked) else ():
            visit(each)
        order.append(one)

    for each in library._linking_libraries:
        visit(each)
    return order[::-1]


def code_of(library: Any) -> Any:
    """Return the code to link of a library that `called` returned."""
    if isinstance(library, Linked):
        return library.alone()
    return library._get_module_for_linking()


class Light(PassManager):
    """Passes without timers and checks; the life of variables is found where passes change the flow of control."""

    @global_compiler_lock
    def _runPass(self, index: int, pss: Any, internal_state: Any) -> None:
        pss.analysis = self._analysis
        name = internal_state.func_id.func_qualname
        data = {"name": f"{pss.name()} [{name}]", "qualname": name}
        with event.trigger_event("numba:run_pass", data=data):
            changed = pss.run_initialization(internal_state)
            changed |= pss.run_pass(internal_state)
            changed |= pss.run_finalizer(internal_state)
        if compiler_machinery._pass_registry.get(pss.__class__).mutates_CFG:
            internal = internal_state.func_ir
            internal.blocks = transforms.canonicalize_cfg(internal.blocks)
            if changed:
                internal.variable_lifetime = postproc.VariableLifetime(internal.blocks)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(typed_passes.NativeLowering):
    """Pass that makes linked code, and a key by which callers find it in place of a function for Python."""

    _name = "lowering of inner functions"

    def run_pass(self, state: Any) -> bool:
        state.library = Linked(state.targetctx.codegen(), state.func_id.func_qualname)
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
        passes = Light("inner")
        for each, words in DefaultPassBuilder.define_nopython_pipeline(
            self.state
        ).passes:
            if each.__name__ not in _NEEDLESS:
                passes.add_pass(
                    _Lowering if each is typed_passes.NativeLowering else each, words
                )
        passes.finalize()
        return [passes]
