"""How the compiler makes kernels that live only inside others: without machine code of their own.

numba optimizes every function that it compiles and emits its machine code, although nothing ever
calls an inlined one by itself. Here such a part stays what it was lowered to until the function
that is called from Python is compiled, and is optimized once, inside it.
"""

from __future__ import annotations

from typing import Any

from numba import _dynfunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, _LowerResult
from numba.core.compiler_machinery import register_pass
from numba.core.environment import lookup_environment
from numba.core.typed_passes import NativeLowering, NopythonRewrites


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that waits to be linked into its callers."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):  # type: ignore[misc]
    """Lowers a part, and lets others call it by its code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        state.library._ensure_finalized()
        # Callers find the part by this function, which is at no address and is never called.
        name = lowered.fndesc.qualname
        module = lowered.fndesc.lookup_module()
        entry = _dynfunc.make_function(module, name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(entry, lowered.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state["cr"] = _LowerResult(lowered.fndesc, lowered.call_helper, entry, lowered.env)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _WholeLowering(NativeLowering):  # type: ignore[misc]
    """Lowers a function with its parts, and gives each part its constants."""

    _name = "whole_lowering"

    def run_pass(self, state: Any) -> bool:
        super().run_pass(state)
        for variable in state.library._final_module.global_variables:
            name = variable.name
            if name.startswith("_ZN08NumbaEnv") and (found := lookup_environment(name)):
                state.library.codegen.set_env(name, found)
        return True


class _Compiler(CompilerBase):  # type: ignore[misc]
    """numba's own with another lowering, and without joining operations on arrays."""

    lowering: Any

    def define_pipelines(self) -> list[Any]:
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (self.lowering if each is NativeLowering else each, why)
            for each, why in manager.passes
            if each is not NopythonRewrites
        ]
        manager.finalize()
        return [manager]


class Parts(_Compiler):
    """Compiles what is inlined."""

    lowering = _PartLowering


class Whole(_Compiler):
    """Compiles what is called from Python."""

    lowering = _WholeLowering
