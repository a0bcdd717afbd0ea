"""Types of a kernel's variables, found as numba finds them, with less done twice.

numba goes through all statements until no type changes any more, twice at least: here a statement is looked at again
only where a type that it asked for has changed since. Kernels do not call themselves: what a call returns depends on
the types of its arguments alone.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler_machinery import register_pass
from numba.core.errors import ForceLiteralArg, NumbaWarning, TypingError, WarningsFixer  # type: ignore[attr-defined]
from numba.core.typed_passes import NopythonTypeInference
from numba.core.typeinfer import ConstraintNetwork, TypeInferer, TypeVarMap


class _Variables(TypeVarMap):
    """The variables of a function, and which of them were asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Any] = []

    def __getitem__(self, name: str) -> Any:
        found = self.get(name)
        if found is None:
            found = super().__getitem__(name)
        self.asked.append(found)
        return found


class _Network(ConstraintNetwork):
    """What statements say of types."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: dict[Any, list[tuple[Any, Any]]] = {}

    def propagate(self, typeinfer: Any) -> list[TypingError]:
        """As numba, for statements some of whose variables have another type than when they were looked at last."""
        variables = typeinfer.typevars
        errors: list[TypingError] = []
        for constraint in self.constraints:
            seen = self._seen.get(constraint)
            if seen is not None and all(variable.type is kind for variable, kind in seen):
                continue
            asked: list[Any] = []
            variables.asked = asked
            try:
                constraint(typeinfer)
            except TypingError as error:
                if not isinstance(error, ForceLiteralArg):
                    told = TypingError(str(error), loc=constraint.loc, highlighting=False)
                    told.__cause__, error = error, told
                errors.append(error)
                self._seen.pop(constraint, None)
            else:
                self._seen[constraint] = [(variable, variable.type) for variable in asked]
        return errors


class _Inference(TypeInferer):
    """numba's inference on these."""

    def __init__(self, context: Any, func_ir: Any, warnings: Any) -> None:
        super().__init__(context, func_ir, warnings)
        self.typevars = _Variables()
        self.typevars.set_context(context)
        self.constraints = _Network()

    def get_state_token(self) -> list[Any]:
        """The types of all variables."""
        return [variable.type for variable in self.typevars.values()]


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelTypes(NopythonTypeInference):
    """numba's pass with this inference."""

    _name = "kernel_types"

    def run_pass(self, state: Any) -> bool:
        """As numba."""
        code, warnings = state.func_ir, WarningsFixer(NumbaWarning)
        found = _Inference(state.typingctx, code, warnings)
        calls = state.typingctx.callstack.register(state.targetctx.target, found, code.func_id, state.args)
        here = warnings.catch_warnings(filename=code.loc.filename, lineno=code.loc.line)
        with calls, warnings:
            for index, (name, kind) in enumerate(zip(code.arg_names, state.args, strict=True)):
                found.seed_argument(name, index, kind)
            with here:
                found.build_constraint()
                found.propagate()
            state.typemap, state.return_type, state.calltypes = found.unify()
        return True
