"""The libraries keep nothing for the whole process: no variable that can change, but those below."""
import re
import subprocess
import sys

REASONS = {
    "c_locale": "made once, by pthread_once()",
    "c_locale_once": "pthread_once()'s own",
    "runnable": "filled before main(), then constant",
    "__ioinit": "of the C++ library, where <iostream> is included",
    "guard variable for initialized": "made once: OpenVDB's types are registered",
    "host": "the program's functions, the same each time (preprocess/vdb/module.c)",
}
OTHERS = re.compile(r"^(guard variable for )?openvdb::|^DW\.ref\.|"  # from headers and the compiler
                    r"^(completed\.\d+|__TMC_END__|__dso_handle)$")  # in every shared library
WRITABLE = re.compile(r"^(\.data|\.bss|\*COM\*|\.data\.(?!rel\.ro)\S+|\.bss\.\S+)$")


def variables(library):
    """(object file, name) of all that lies where it can be written, but thread-local variables."""
    table = subprocess.run(["objdump", "-tC", library], check=True, text=True, capture_output=True)
    where = ""
    for line in table.stdout.splitlines():
        if ":     file format" in line:
            where = line.split(":")[0]
        match = re.match(r"^[0-9a-f]{16} (.{7}) (\S+)\t[0-9a-f]{16} +(?:\.hidden )?(.+)$", line)
        if match and "O" in match.group(1) and WRITABLE.match(match.group(2)):
            yield where, match.group(3)


def name_of(symbol):
    """Without its scope and the number by which functions' statics differ."""
    symbol = re.sub(r"\.\d+$", "", symbol)
    return re.sub(r"^(guard variable for )?.*::(\w+)$", r"\1\2", symbol)


def main(libraries):
    found = [(library, *variable) for library in libraries for variable in variables(library)]
    bad = [f"{library}: {where}: {symbol}" for library, where, symbol in found
           if name_of(symbol) not in REASONS and not OTHERS.match(symbol)]
    if not any(name_of(symbol) == "c_locale" for _, _, symbol in found):
        sys.exit("not even the C locale is found: objdump's output is not understood")
    if bad:
        sys.exit("kept for the whole process:\n" + "\n".join(bad))


main(sys.argv[1:])
