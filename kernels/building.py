"""The compiler: kernels as object files. Runs in a process of its own, so that what it asks of numba is nobody else's.

What numba's front end makes of the kernels, four fifths of the work and the same on every processor of a kind, comes
with the package (`kernels.packing`); LLVM makes machine code of it for this one. Where it is of other sources, another
kind of processor, or a newer LLVM, numba does all of it.

An object file holds a kernel, all that it calls, a door and the memory of its arrays. The door takes one argument, the
packed values that numba would pass the kernel in registers; `kernels.native` packs them.
"""

import importlib
import json
import os
import re
import sys
import zipfile
from collections.abc import Callable
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir

from towatlas.kernels import calls
from towatlas.kernels.native import DTYPES, SOURCE_FOLDER, Kernel, ready_llvm, source_hash

BYTE, WORD, INT, DOUBLE = ir.IntType(8), ir.IntType(64), ir.IntType(32), ir.DoubleType()
POINTER, WORDS = BYTE.as_pointer(), WORD.as_pointer()
# The head of an array in numba: references, destructor, its argument, data, size, allocator.
HEAD = 6
# What `kernels.packing` writes.
PACKED = SOURCE_FOLDER / "bitcode.zip"
ABOUT = "about.json"
# With an older LLVM numba puts its passes together in another way, and does all of it.
OWN_PASSES = llvm.llvm_version_info >= (20,)


def main() -> None:
    """Compile what the first argument of the process names.

    On stdout: sizes and object files, one after the other, and at last the size of all of it; what was printed before
    the process came to this, as by sitecustomize, stands before that.
    """
    features, names = json.loads(sys.argv[1])
    os.environ["NUMBA_CPU_FEATURES"] = features
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # whatever else is printed
        made = b""
        for module, name in names:
            kernel = next(found for found in calls.KERNELS if (found.module, found.name) == (module, name))
            code = object_code(kernel, features)
            made += len(code).to_bytes(8, "little") + code
        out.write(made + len(made).to_bytes(8, "little"))


def object_code(kernel: Kernel, features: str) -> bytes:
    """The object file of a kernel."""
    ready_llvm()
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=features, opt=3, reloc="static", codemodel="jitdefault", jit=True
    )
    name, module = (packed(kernel) if OWN_PASSES else None) or _compiled(kernel)
    if OWN_PASSES:
        _optimise(module, machine)
    own = ir.Module()
    own.triple, own.data_layout = module.triple, str(module.data_layout)
    _memory(own)
    _door(own, name, kernel)
    module.link_in(llvm.parse_assembly(str(own)))
    module.verify()
    return machine.emit_object(module)


def packed(kernel: Kernel) -> tuple[str, Any] | None:
    """Name and module of a kernel as they come with the package; None where that is of no use here."""
    try:
        with zipfile.ZipFile(PACKED) as file:
            about = json.loads(file.read(ABOUT))
            here = about["sources"] == source_hash() and about["triple"] == llvm.get_process_triple()
            if not here or about["llvm"] > llvm.llvm_version_info[0]:
                return None
            name = f"{kernel.module}.{kernel.name}"
            symbol, module = about["symbols"][name], llvm.parse_bitcode(file.read(name))
            return None if module.get_function(symbol).is_declaration else (symbol, module)
    except Exception:  # whatever it holds; there is another way
        return None


def _optimise(module: Any, machine: Any) -> None:
    """What numba has LLVM do with a module when all of it is there."""

    def passes() -> tuple[Any, Any]:
        tuning = llvm.create_pipeline_tuning_options(speed_level=3)
        tuning.loop_vectorization, tuning.slp_vectorization = True, False
        builder = llvm.create_pass_builder(machine, tuning)
        return builder.getModulePassManager(), builder

    first, builder = passes()
    first.add_loop_rotate_pass()
    first.add_instruction_combine_pass()
    first.add_jump_threading_pass()
    first.add_refprune_pass(llvm.RefPruneSubpasses.ALL)
    first.run(module, builder)
    second, builder = passes()
    second.add_refprune_pass(llvm.RefPruneSubpasses.ALL)
    second.run(module, builder)


def _compiled(kernel: Kernel) -> tuple[str, Any]:
    """Name and module of a kernel by numba."""
    if OWN_PASSES and (found := front_end(kernel)):
        name, code = found
        return name, llvm.parse_bitcode(code)
    name, text = _by_numba(kernel)
    return name, llvm.parse_assembly(_aligned(text()))


# What numba hands to LLVM, by name of the function; one may be there for arguments of several kinds.
_modules: dict[str, list[bytes]] = {}


def front_end(kernel: Kernel) -> tuple[str, bytes] | None:
    """Name and bitcode of a kernel and all that it calls, of which LLVM has made nothing yet; None if not to be had."""
    from numba.core.codegen import CPUCodeLibrary

    # Private to numba. In its place nothing is done: `_optimise` has LLVM do it, once, and not for each helper before.
    def kept(library: Any) -> None:
        _modules.setdefault(library.name, []).append(library._final_module.as_bitcode())

    its_own: Any = getattr(CPUCodeLibrary, "_optimize_final_module", None)
    if its_own is None:
        return None
    setattr(CPUCodeLibrary, "_optimize_final_module", kept)  # noqa: B010
    try:
        name, _ = _by_numba(kernel)
    finally:
        setattr(CPUCodeLibrary, "_optimize_final_module", its_own)  # noqa: B010
    found = [code for code in _modules.get(kernel.name, []) if _defines(code, name)]
    return (name, llvm.parse_assembly(_aligned(str(llvm.parse_bitcode(found[0])))).as_bitcode()) if found else None


def _aligned(text: str) -> str:
    """A module whose functions keep their stack on whole lines of the cache.

    Vectors of 512 bits that do not fit the registers would lie across two otherwise, and take twice as long to load.
    """
    return re.sub(r"^(define .*?)((?: comdat)?(?: !.*)? \{)$", r'\1 "stackrealign"\2', text, flags=re.MULTILINE)


def _defines(code: bytes, symbol: str) -> bool:
    try:
        return not llvm.parse_bitcode(code).get_function(symbol).is_declaration
    except NameError:
        return False


def _by_numba(kernel: Kernel) -> tuple[str, Callable[[], str]]:
    """Name of a kernel that numba has compiled, and what gives its optimised module as text."""
    import numba

    function: Any = getattr(importlib.import_module(f"towatlas.kernels.{kernel.module}"), kernel.name)
    kinds = tuple(_kind(argument) for argument in kernel.arguments)
    signature = tuple(kind for group in kinds for kind in (group if isinstance(group, list) else [group]))
    function.compile(numba.void(*signature))
    return function.overloads[signature].fndesc.llvm_func_name, lambda: function.inspect_llvm(signature)


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
