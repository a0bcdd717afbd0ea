"""The compiler of kernels: fewer passes and lookups than numba's, the same results."""

from __future__ import annotations

import math

import llvmlite.binding
import numba
import numpy as np
import pytest
from llvmlite import ir

from fubini._builder import Builder, sweep
from fubini._compiler import _Flags, _Lookups, _single_assignments
from fubini._inference import _Network, _Variables
from fubini._jit import inner, kernel


def numbers(a, b, i, j):
    """Operators and functions that numba finds by the types of numbers."""
    low, high = min(a, b, 1.5), max(i, j)
    mixed = a * i + b / max(1, j) - (i % 7) * 0.5 + (i // 3) + i**2 + a**3
    bits = (i << 2) ^ (j >> 1) & 5
    return low, high, mixed, bits, int(a), np.int64(b), abs(-a), -i, not i > j, a < b <= 2.0


def loops(values, first):
    """Jumps out of loops, names that hold several values in turn, conditions in expressions."""
    total, last = 0.0, -1
    for k in range(values.shape[0]):
        if values[k] < 0.0:
            continue
        if values[k] > 8.0:
            break
        total += values[k] if k % 2 == first else 0.5 * values[k]
        last = k
    while last > 0 and total > 1.0:
        last -= 1
        total *= 0.5
    a, b = (total, last) if last >= 0 else (0.0, 0)
    return a + math.sqrt(b) + math.hypot(a, 1.0)


def arrays(values, table):
    """Rows, slices with steps, tuples, augmented items."""
    out = np.zeros(4, np.int64)
    row = table[1]
    pair = (row[0], values[2])
    out[:2] = table[0, :2]
    out[2] += row[1] + int(pair[1])
    for r in table:
        out[3] = max(out[3], r[values.shape[0] - 1])
    return out


def extremes(a, b, i):
    """Numbers of one type and of two, more than two, and what is no number."""
    return min(a, b), max(a, b), min(i, 3), max(i, 2, 5), min(a, i), max(b, i, 0.5)


@pytest.mark.parametrize(
    ("a", "b"), [(1.0, 2.0), (math.nan, 1.0), (1.0, math.nan), (-0.0, 0.0), (0.0, -0.0), (-1.5, 4.0)]
)
def test_least_and_greatest_are_those_of_plain_python(a, b):
    compiled = kernel(extremes)
    for i in (-7, 2, 40):
        assert list(map(repr, map(float, compiled(a, b, i)))) == list(map(repr, map(float, extremes(a, b, i))))


@kernel(allocates=True)
def new_arrays(n):
    """Arrays of several types and shapes, filled."""
    flat, table, default = np.empty(n, np.int32), np.empty((n, 3), np.uint8), np.empty(2 * n)
    flat[:], table[:], default[:] = 7, 9, 0.5
    return flat, table, default


def test_new_arrays_have_the_size_and_type_asked():
    flat, table, default = new_arrays(5)
    assert (flat.dtype, table.dtype, default.dtype) == (np.int32, np.uint8, float)
    assert (flat.shape, table.shape, default.shape) == ((5,), (5, 3), (10,))
    assert (flat == 7).all()
    assert (table == 9).all()
    assert (default == 0.5).all()


def test_results_are_those_of_plain_python():
    compiled = kernel(numbers)
    for a, b, i, j in ((0.5, 2.0, 3, 4), (2.5, -1.0, 9, 2), (-0.25, 0.75, 0, 0)):
        assert compiled(a, b, i, j) == pytest.approx(numbers(a, b, i, j), rel=1e-15)


def test_loops_and_branches_are_those_of_plain_python():
    compiled = kernel(loops)
    for values in ([1.0, -2.0, 3.0, 9.0, 1.0], [-1.0], [0.25, 0.125], []):
        for first in (0, 1):
            assert compiled(np.array(values), first) == pytest.approx(loops(np.array(values), first), rel=1e-15)


def test_arrays_are_those_of_plain_python():
    values, table = np.array([1.0, 2.0, 3.5]), np.array([[1, 2, 3], [4, 5, 60], [7, 8, 9]])
    assert kernel(arrays, allocates=True)(values, table).tolist() == arrays(values, table).tolist()


def counted(first, stop, step, values):
    """Ranges with steps that are known and not, left early, with a name that holds the last number."""
    total, last = 0, -100
    for i in range(stop):
        total += i * i
        last = i
    for i in range(first, stop):
        total = 3 * total + i
        if i == 4:
            break
    for i in range(stop, first, -1):
        total -= 5 * i
    for i in range(first, stop, 2):
        total += 7 * i
    for i in range(stop, first, -3):
        total -= 11 * i
    for i in range(first, stop, step):
        total += 13 * i
        for j in range(values.shape[0]):
            i += 1
            total ^= i + j
    pair = range(2, 4)
    for i in pair:
        for j in pair:
            total += i * j
    return total, last


@pytest.mark.parametrize(("first", "stop", "step"), [(0, 9, 2), (-3, 7, 1), (2, 2, -1), (6, -4, -2), (9, 3, 4)])
def test_ranges_are_those_of_plain_python(first, stop, step):
    values = np.zeros(2)
    assert kernel(counted)(first, stop, step, values) == counted(first, stop, step, values)


def test_a_range_without_a_step_is_refused():
    with pytest.raises(ValueError, match="zero"):
        kernel(counted)(0, 3, 0, np.zeros(1))


def shares(i, j):
    """Integers divided by constants and by numbers, bits of integers."""
    return i % 3, i // 3, i % 8, i // 8, i % 1, i // -4, i % -4, i // j, i % j, i >> 2, i << 3, i & 6, i | 9, i ^ 5


def test_integers_are_divided_towards_less():
    compiled = kernel(shares)
    for i in (*range(-17, 18), 2**59 + 1, -(2**59) - 1):
        for j in (-5, 7):
            assert compiled(i, j) == shares(i, j)


def test_new_arrays_of_zeros_hold_zeros():
    @kernel(allocates=True)
    def zeros(n):
        return np.zeros(n), np.zeros((n, 2), np.int32)

    np.full(10_000, 1.5)  # memory that held something else
    flat, table = zeros(10_000)
    assert (flat.shape, table.shape, table.dtype) == ((10_000,), (10_000, 2), np.int32)
    assert table.strides == (8, 4)
    assert not flat.any()
    assert not table.any()


@inner(allocates=True)
def allotted(n, log):
    """An array, or an error and nothing more."""
    log[0] += 1
    made = np.empty((n, 3))
    log[1] += 1
    return made


@pytest.mark.parametrize("size", [-1, -(2**59), 2**50, 2**62, 2**63 - 1])
def test_arrays_without_end_or_of_negative_size_are_refused_by_every_caller(size):
    @inner(allocates=True)
    def between(n, log):
        return allotted(n, log).shape[0]

    @kernel(allocates=True)
    def outer(n, log):
        got = between(n, log)
        log[2] += 1
        return got

    log = np.zeros(3, np.int64)
    assert outer(5, log) == 5
    with pytest.raises(MemoryError):
        outer(size, log)
    assert log.tolist() == [2, 1, 1]


def test_parts_of_values_are_those_put_in_and_what_nothing_uses_goes():
    pair, number = ir.LiteralStructType([ir.IntType(64), ir.ArrayType(ir.IntType(64), 2)]), ir.IntType(64)
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(number, [number, pair.as_pointer()]), "f")
    builder = Builder(function.append_basic_block())
    given, address = function.args
    idle = builder.slot(number)
    builder.store(given, idle)  # written, never read
    whole = builder.load(address)
    made = builder.insert_value(builder.insert_value(whole, given, 0), given, (1, 1))
    assert builder.extract_value(made, 0) is given
    assert builder.extract_value(made, (1, 1)) is given
    first = builder.extract_value(made, (1, 0))
    assert builder.extract_value(whole, (1, 0)) is first  # taken out once
    inside = builder.extract_value(made, 1)
    assert builder.extract_value(inside, 1) is given
    with builder.if_then(builder.icmp_signed("<", given, first)):
        late = builder.extract_value(whole, (1, 1))
        builder.ret(late)
    builder.ret(builder.add(first, builder.extract_value(inside, 0)))
    before = sum(len(block.instructions) for block in function.blocks)
    sweep(function)
    names = [instruction.opname for block in function.blocks for instruction in block.instructions]
    assert len(names) < before
    assert not {"alloca", "store", "insertvalue"} & set(names)
    assert names.index("extractvalue") == names.index("load") + 1
    llvmlite.binding.parse_assembly(str(module)).verify()


def code_of(function, assign):
    """numba's code of a function with each name assigned once, as text."""
    code = numba.core.compiler.run_frontend(function)
    code.blocks = assign(numba.core.transforms.canonicalize_cfg(code.blocks))
    return {label: [str(statement) for statement in block.body] for label, block in code.blocks.items()}


@pytest.mark.parametrize("function", [loops, counted, arrays, numbers])
def test_names_are_assigned_once_as_numba_does(function):
    found = code_of(function, _single_assignments)
    assert found == code_of(function, numba.core.ssa._run_ssa)
    if function in (loops, counted):
        assert found != code_of(function, lambda blocks: blocks)


def widening(n):
    """Names that are integers before they turn out to be floating point numbers, further down, by each other."""
    a, b, c = 0, 1, 2
    for i in range(n):
        c = b + i
        b = a + c
        a = a + 0.25 * b if i % 2 else a
    return a, b, c


def test_types_that_grow_are_those_of_plain_python():
    for n in (0, 1, 6):
        assert kernel(widening)(n) == widening(n)


def test_a_statement_is_looked_at_again_where_a_type_that_it_asked_for_has_changed():
    looks = []

    class Copy:
        """The type of one variable handed on to another."""

        def __init__(self, source, target):
            self.source, self.target, self.loc = source, target, None

        def __call__(self, types):
            looks.append(self.target)
            kind = types.typevars[self.source].type
            if kind is not None:
                types.typevars[self.target].type = kind

    class Found:
        typevars = _Variables()

    Found.typevars.set_context(None)
    Found.typevars["first"].type = numba.int64
    network = _Network()
    for source, target in (("second", "third"), ("first", "second")):
        network.append(Copy(source, target))
    for seen in (["third", "second"], ["third"], []):
        looks.clear()
        assert network.propagate(Found) == []
        assert looks == seen
    Found.typevars["first"].type = numba.float64
    network.propagate(Found)
    network.propagate(Found)
    assert Found.typevars["third"].type == numba.float64


def test_one_signature_for_each_function_and_types_as_numba_finds_it():
    context = numba.core.registry.cpu_target.typing_context
    context.refresh()
    lookups = _Lookups(context)
    add = context.resolve_value_type(numba.core.typing.builtins.operator.add)
    for left, right in ((numba.int64, numba.float64), (numba.int32, numba.int64), (numba.uint8, numba.uint8)):
        found = lookups.resolve_function_type(add, (left, right), {})
        assert found == context.resolve_function_type(add, (left, right), {})
        assert lookups.resolve_function_type(add, (left, right), {}) is found
    assert lookups.tm is context.tm


def test_flags_compare_as_those_of_numba():
    plain, other = numba.core.compiler.Flags(), numba.core.compiler.Flags()
    other.nrt = True
    for one in (plain, other):
        assert _Flags(one).values() == one.values()
        for two in (plain, other):
            assert (_Flags(one) == _Flags(two)) == (one == two)
    assert _Flags(other).copy().nrt
    assert isinstance(_Flags(other).copy(), _Flags)


def test_functions_for_kernels_alone_are_not_made_before_a_kernel_is_compiled(tmp_path, monkeypatch):
    monkeypatch.setenv("FUBINI_CACHE_DIR", str(tmp_path))  # a kernel kept by an earlier run is not compiled

    @inner
    def part(n):
        return n + 1

    @kernel
    def whole(n):
        return 2 * part(n)

    assert "dispatcher" not in vars(part)
    assert whole(3) == 8
    assert "dispatcher" in vars(part)
    assert not callable(part)  # it has no machine code of its own


def test_what_the_passes_do_not_cover_is_refused():
    @kernel
    def closure(n):
        def inside(k):
            return k + n

        return inside(n)

    with pytest.raises(numba.core.errors.NumbaError):
        closure(3)

    @kernel
    def last(values):
        return values[-1]

    with pytest.raises(IndexError, match="from the first"):
        last(np.ones(2))
