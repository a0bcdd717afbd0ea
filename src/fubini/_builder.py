"""Intermediate code of kernels without what the optimiser would only take away again.

numba writes an array as one value of seven parts and more: every use takes it apart, every call puts it together. Here
a part that was put in is handed back as it is, any other is taken out once, and what nothing asks for goes before the
code is written out: less than half is left for LLVM to read.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from llvmlite import ir
from llvmlite.ir.instructions import AllocaInstr, CallInstr, InsertValue, Instruction, PhiInstr, StoreInstr

#: Instructions that may go where nothing uses them.
PURE = frozenset(
    "insertvalue extractvalue getelementptr load alloca bitcast sext zext trunc fptosi sitofp icmp fcmp select "
    "add sub mul and or xor shl ashr lshr fadd fsub fmul fdiv".split()
)


class Builder(ir.IRBuilder):
    """llvmlite's builder, which takes parts out of values once."""

    _block: Any
    _anchor: int

    def __init__(self, block: Any) -> None:
        super().__init__(block)
        self._taken: dict[tuple[Any, tuple[int, ...]], Any] = {}

    def insert_value(self, agg: Any, value: Any, idx: Any, name: str = "") -> Any:
        """As llvmlite, without a name."""
        return super().insert_value(agg, value, idx)

    def extract_value(self, agg: Any, idx: Any, name: str = "") -> Any:
        """As llvmlite: what was inserted there, or what is taken out behind the instruction that made the whole."""
        path = tuple(idx) if isinstance(idx, tuple | list) else (idx,)
        while type(agg) is InsertValue:
            at = tuple(agg.indices)
            n = min(len(at), len(path))
            if at[:n] == path[:n]:
                if len(at) <= len(path):
                    return self.extract_value(agg.value, path[n:]) if path[n:] else agg.value
                return self.insert_value(self.extract_value(agg.aggregate, path), agg.value, at[n:])
            agg = agg.aggregate
        if not isinstance(agg, Instruction) or isinstance(agg, PhiInstr):
            return super().extract_value(agg, path)
        found = self._taken.get((agg, path))
        if found is None:
            found = self._taken[agg, path] = self._behind(agg, path)
        return found

    def _behind(self, whole: Any, path: tuple[int, ...]) -> Any:
        """A part of a value, taken out behind the instruction that made it: all that uses the value may use it."""
        here, at = self._block, self._anchor
        self.position_after(whole)
        place = self._anchor
        found = super().extract_value(whole, path)
        self._block, self._anchor = here, at + (whole.parent is here and place <= at)
        return found

    def slot(self, kind: Any) -> Any:
        """Memory of the function for a value of this type, unlike numba's not filled with zeros."""
        with self.goto_entry_block():
            return self.alloca(kind)


def sweep(function: Any) -> None:
    """Take away what nothing uses, and memory that is only written."""
    uses: Counter[int] = Counter()
    stores: dict[int, list[Any]] = {}
    for block in function.blocks:
        for instruction in block.instructions:
            uses.update(map(id, _operands(instruction)))
            if isinstance(instruction, StoreInstr) and isinstance(instruction.operands[1], AllocaInstr):
                slot = id(instruction.operands[1])
                uses[slot] -= 1
                stores.setdefault(slot, []).append(instruction)
    idle = [i for block in function.blocks for i in block.instructions if i.opname in PURE and not uses[id(i)]]
    gone: set[int] = set()
    while idle:
        instruction = idle.pop()
        gone.add(id(instruction))
        written = stores.get(id(instruction), [])
        gone.update(map(id, written))
        for operand in (*(store.operands[0] for store in written), *_operands(instruction)):
            uses[id(operand)] -= 1
            if not uses[id(operand)] and isinstance(operand, Instruction) and operand.opname in PURE:
                idle.append(operand)
    for block in function.blocks:
        block.instructions[:] = [i for i in block.instructions if id(i) not in gone]


def _operands(instruction: Any) -> Any:
    """The values that an instruction uses."""
    if isinstance(instruction, PhiInstr):
        return [value for value, _ in instruction.incomings]
    if isinstance(instruction, CallInstr):
        return [instruction.callee, *instruction.operands]
    return instruction.operands
