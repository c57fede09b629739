"""The compiler: kernels as object files. Runs in a process of its own, so that what it asks of numba is nobody else's.

An object file holds a kernel, all that it calls, a door and the memory of its arrays. The door takes one argument, the
packed values that numba would pass the kernel in registers; `kernels.native` packs them.
"""

import importlib
import json
import os
import sys
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir

from towatlas.kernels import calls
from towatlas.kernels.native import DTYPES, Kernel

BYTE, WORD, INT, DOUBLE = ir.IntType(8), ir.IntType(64), ir.IntType(32), ir.DoubleType()
POINTER, WORDS = BYTE.as_pointer(), WORD.as_pointer()
# The head of an array in numba: references, destructor, its argument, data, size, allocator.
HEAD = 6


def main() -> None:
    """Compile what the first argument of the process names: sizes and object files, one after the other, on stdout."""
    features, names = json.loads(sys.argv[1])
    os.environ["NUMBA_CPU_FEATURES"] = features
    _optimise_once()
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # whatever else is printed
        for module, name in names:
            kernel = next(found for found in calls.KERNELS if (found.module, found.name) == (module, name))
            code = object_code(kernel, features)
            out.write(len(code).to_bytes(8, "little") + code)


def _optimise_once() -> None:
    """Have LLVM optimise a kernel together with all it calls, and not each of these before, level by level."""
    from numba.core.codegen import CPUCodeLibrary

    # Private to numba, and only a matter of time: left alone where there is no such method.
    optimise: Any = getattr(CPUCodeLibrary, "_optimize_final_module", None)
    if optimise is not None:
        whole = {kernel.name for kernel in calls.KERNELS}

        def once(library: Any) -> None:
            if library.name in whole:
                optimise(library)

        setattr(CPUCodeLibrary, "_optimize_final_module", once)  # noqa: B010


def object_code(kernel: Kernel, features: str) -> bytes:
    """The object file of a kernel."""
    import numba

    function: Any = getattr(importlib.import_module(f"towatlas.kernels.{kernel.module}"), kernel.name)
    kinds = tuple(_kind(argument) for argument in kernel.arguments)
    signature = tuple(kind for group in kinds for kind in (group if isinstance(group, list) else [group]))
    function.compile(numba.void(*signature))
    name = function.overloads[signature].fndesc.llvm_func_name
    module = llvm.parse_assembly(function.inspect_llvm(signature))
    own = ir.Module()
    own.triple, own.data_layout = module.triple, str(module.data_layout)
    _memory(own)
    _door(own, name, kernel)
    module.link_in(llvm.parse_assembly(str(own)))
    module.verify()
    machine = llvm.Target.from_triple(module.triple).create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=3, reloc="static", codemodel="jitdefault", jit=True
    )
    return machine.emit_object(module)


def _kind(argument: Any) -> Any:
    """numba's type of an argument, or a list of types."""
    import numba
    from numba import types

    def one(code: str) -> Any:
        kind = numba.from_dtype(DTYPES[code[0]])  # type: ignore[arg-type]
        return types.Array(kind, int(code[1:]), "C") if code[1:] else kind

    if isinstance(argument, tuple):
        return types.NamedTuple([one(code) for code in argument[1].split()], argument[0])
    return [one(code) for code in argument.split()]


def _memory(module: ir.Module) -> None:
    """What numba's runtime does for arrays: their memory taken, and given back when nobody holds it."""
    malloc = ir.Function(module, ir.FunctionType(POINTER, [WORD]), "malloc")
    free = ir.Function(module, ir.FunctionType(ir.VoidType(), [POINTER]), "free")

    function = ir.Function(module, ir.FunctionType(POINTER, [WORD, INT]), "NRT_MemInfo_alloc_aligned")
    size, align = function.args
    builder = ir.IRBuilder(function.append_basic_block())
    align = builder.zext(align, WORD)
    head = builder.call(malloc, [builder.add(builder.add(size, align), WORD(8 * HEAD))])
    with builder.if_then(builder.icmp_unsigned("==", head, ir.Constant(POINTER, None))):
        builder.ret(ir.Constant(POINTER, None))
    past = builder.add(builder.ptrtoint(head, WORD), builder.add(align, WORD(8 * HEAD - 1)))
    data = builder.and_(past, builder.neg(align))
    words = builder.bitcast(head, WORDS)
    for place, value in enumerate((WORD(1), WORD(0), WORD(0), data, size, WORD(0))):
        builder.store(value, builder.gep(words, [WORD(place)]))
    builder.ret(head)

    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [POINTER]), "NRT_MemInfo_call_dtor")
    builder = ir.IRBuilder(function.append_basic_block())
    builder.call(free, [function.args[0]])
    builder.ret_void()

    # A whole array seen as one of one dimension, which is all the seeing otherwise there is: its stride is an entry.
    kind = ir.FunctionType(INT, [WORD, WORDS, WORDS, WORD, WORDS, WORDS, WORD, INT])
    function = ir.Function(module, kind, "numba_attempt_nocopy_reshape")
    dimensions, strides, entry = function.args[3], function.args[5], function.args[6]
    builder = ir.IRBuilder(function.append_basic_block())
    with builder.if_then(builder.icmp_unsigned("!=", dimensions, WORD(1))):
        builder.ret(INT(0))
    builder.store(entry, strides)
    builder.ret(INT(1))


def _door(module: ir.Module, name: str, kernel: Kernel) -> None:
    """A function of one pointer, to the arguments one after the other, eight bytes each."""
    kinds = []
    for code in kernel.codes:
        kinds += [POINTER, POINTER, WORD, WORD, POINTER, *[WORD] * (2 * code.dimensions)] if code.dimensions else []
        kinds += [] if code.dimensions else [DOUBLE if code.layout == "d" else WORD]
    inner = ir.Function(module, ir.FunctionType(INT, [POINTER, POINTER, *kinds]), name)
    door = ir.Function(module, ir.FunctionType(INT, [POINTER]), kernel.symbol)
    builder = ir.IRBuilder(door.append_basic_block())
    # Places for a result and an exception; kernels have none, but that memory ends.
    places = [builder.bitcast(builder.alloca(POINTER), POINTER) for _ in range(2)]
    values = []
    for place, kind in enumerate(kinds):
        at = builder.gep(door.args[0], [WORD(8 * place)])
        word = builder.load(builder.bitcast(at, WORDS))
        if kind is POINTER:
            values.append(builder.inttoptr(word, POINTER))
        else:
            values.append(word if kind is WORD else builder.bitcast(word, DOUBLE))
    builder.ret(builder.call(inner, [*places, *values]))
