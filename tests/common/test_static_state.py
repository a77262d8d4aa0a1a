"""Tests that the libraries have no writable global variable except the ones listed here."""
import re
import subprocess
import sys

REASONS = {
    "c_locale": "set once by pthread_once()",
    "c_locale_once": "used by pthread_once()",
    "runnable": "set before main(), then constant",
    "__ioinit": "set by the C++ library if <iostream> is included",
    "guard variable for initialized": "set once when the types of OpenVDB are registered",
    "host": "functions of the program, always the same (preprocess/vdb/module.c)",
}
OTHERS = re.compile(r"^(guard variable for )?openvdb::|^DW\.ref\.|"  # from headers
                    r"^(completed\.\d+|__TMC_END__|__dso_handle)$")  # from the compiler
WRITABLE = re.compile(r"^(\.data|\.bss|\*COM\*|\.data\.(?!rel\.ro)\S+|\.bss\.\S+)$")


def variables(library):
    """Yields (object file, name) of all writable variables that are not thread-local."""
    table = subprocess.run(["objdump", "-tC", library], check=True, text=True, capture_output=True)
    where = ""
    for line in table.stdout.splitlines():
        if ":     file format" in line:
            where = line.split(":")[0]
        match = re.match(r"^[0-9a-f]{16} (.{7}) (\S+)\t[0-9a-f]{16} +(?:\.hidden )?(.+)$", line)
        if match and "O" in match.group(1) and WRITABLE.match(match.group(2)):
            yield where, match.group(3)


def name_of(symbol):
    """Returns the name without its scope, and without the number of a static variable of a function."""
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
