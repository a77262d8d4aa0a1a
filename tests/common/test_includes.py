"""Tests that includes form no cycle between folders or modules, and that private headers stay private.

A module is the header and the sources of one name in one folder."""
import os
import re
import sys

# The modules of private headers that are not named NAME_state.h or NAME_internal.h.
OWNERS = {"common/tf_internal": "common/transfer_function", "lib/library_context": "lib/library_context"}


def read_sources(root):
    """Returns {path: text} for the folders that CMakeLists.txt adds, except tests."""
    with open(f"{root}/CMakeLists.txt", encoding="utf-8") as file:
        folders = set(re.findall(r"add_subdirectory\((\w+)\)", file.read())) - {"tests"}
    sources = {}
    for folder in folders:
        for where, _, names in os.walk(f"{root}/{folder}"):
            for name in names:
                if name.endswith((".h", ".c", ".cpp")):
                    path = os.path.join(where, name)
                    with open(path, encoding="utf-8") as file:
                        sources[os.path.relpath(path, root)] = file.read()
    return sources


def includes_of(sources):
    """Yields (path, path of the included header) for the headers in `sources`."""
    for path, text in sorted(sources.items()):
        for name in re.findall(r'^\s*#\s*include\s+["<]([^">]+)[">]', text, re.M):
            found = [other for other in sources if f"/{other}".endswith(f"/{name}")]
            own = [other for other in found if os.path.dirname(other) == os.path.dirname(path)]
            if found:
                yield path, min(own or found)


def is_private(path, text):
    first = re.match(r"\s*/\*.*?\*/", text, re.S)
    return path.endswith(("_state.h", "_internal.h")) or (
        path.endswith(".h") and first and re.search(r"own files|\bprivate\b", first.group()))


def module_of(path, sources):
    stem = os.path.splitext(path)[0]
    public = re.sub(r"_(state|internal)$", "", stem)
    return OWNERS.get(stem) or (public if f"{public}.h" in sources else stem)


def shortest_cycle(edges):
    """Returns a shortest cycle as a list of lines, empty if there is none. edges[a, b] says why."""
    following = {}
    for a, b in edges:
        following.setdefault(a, []).append(b)
    best = []
    for start in following:
        before, queue = {}, [start]
        for node in queue:
            for other in following.get(node, []):
                if other not in before:
                    before[other] = node
                    queue.append(other)
        if start in before:
            cycle = [start, before[start]]
            while cycle[-1] != start:
                cycle.append(before[cycle[-1]])
            best = min(best or cycle, cycle, key=len)
    best.reverse()
    return [f"  {a} -> {b}: {edges[a, b]}" for a, b in zip(best, best[1:])]


def check(sources):
    """Returns the faults as lines."""
    folders, modules, faults = {}, {}, []
    for path, header in includes_of(sources):
        why = f"{path} includes {header}"
        a, b = path.split("/")[0], header.split("/")[0]
        if a != b:
            folders[a, b] = why
        a, b = module_of(path, sources), module_of(header, sources)
        if a != b:
            modules[a, b] = why
        if is_private(header, sources[header]) and \
                not path.startswith(f"{os.path.dirname(header)}/"):
            faults.append(f"a private header is included from another folder: {why}")
    for kind, edges in ("folders", folders), ("modules", modules):
        cycle = shortest_cycle(edges)
        faults += [f"a cycle of {kind}:", *cycle] if cycle else []
    return faults


def test_the_checks_themselves():
    """Checks made-up trees, most of them with one fault."""
    up, down = '#include "up.h"\n', '#include "down.h"\n'
    good = {"a/up.c": up + down, "a/up.h": "", "b/down.h": "", "b/down.c": down}
    assert check(good) == []
    assert check({**good, "b/down.c": up}) == [
        "a cycle of folders:", "  a -> b: a/up.c includes b/down.h",
        "  b -> a: b/down.c includes a/up.h",
        "a cycle of modules:", "  a/up -> b/down: a/up.c includes b/down.h",
        "  b/down -> a/up: b/down.c includes a/up.h"]
    assert check({**good, "a/up_state.h": up, "a/up.c": '#include "up_state.h"'}) == []
    state = '#include "down_state.h"'
    assert len(check({**good, "b/down_state.h": "", "a/up.c": state})) == 1
    assert len(check({**good, "b/down.h": "/* For b's own files. */"})) == 1


def main(root):
    test_the_checks_themselves()
    sources = read_sources(root)
    if sum(1 for _ in includes_of(sources)) < 1000:
        sys.exit("hardly any include is found: the sources are not understood")
    faults = check(sources)
    if faults:
        sys.exit("\n".join(faults))


main(sys.argv[1])
