"""Memory cgroups, version 1 or 2. Programs in a group get at most its limit, page cache
included."""
import errno
import os
import time


class Group:
    """A group below the group of this process. A with block removes it at its end. Raises OSError
    if no group can be made."""

    def __init__(self, limit_bytes):
        self.limit_bytes = limit_bytes
        parent, self._names = _own_group()
        self._folder = os.path.join(parent, f"triptych-{os.getpid()}")
        os.mkdir(self._folder)
        try:
            self._write(self._names["limit"], limit_bytes)
        except OSError:
            self.remove()
            raise
        try:
            self._write(self._names["swap"], self._names["swap_bytes"](limit_bytes))
        except OSError:
            pass  # this machine does not account for swap

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.remove()

    def enter(self):
        """Moves this process into the group. For preexec_fn."""
        self._write("cgroup.procs", os.getpid())

    def peak_bytes(self):
        """Returns the maximum memory of all programs in the group, with the page cache."""
        with open(os.path.join(self._folder, self._names["peak"])) as f:
            return int(f.read())

    def remove(self):
        """Retries, because the kernel's threads for io_uring leave the group a moment after the
        program has ended."""
        for _ in range(200):
            try:
                return os.rmdir(self._folder)
            except OSError as e:
                if e.errno != errno.EBUSY:
                    raise
            time.sleep(0.05)
        os.rmdir(self._folder)

    def _write(self, name, value):
        with open(os.path.join(self._folder, name), "w") as f:
            f.write(str(value))


def _own_group():
    """Returns the folder of this process's memory cgroup, and the names of its files."""
    v1 = {"limit": "memory.limit_in_bytes", "peak": "memory.max_usage_in_bytes",
          "swap": "memory.memsw.limit_in_bytes", "swap_bytes": lambda n: n}
    v2 = {"limit": "memory.max", "peak": "memory.peak", "swap": "memory.swap.max",
          "swap_bytes": lambda n: 0}
    with open("/proc/self/cgroup") as f:
        lines = dict(line.strip().split(":", 2)[1:] for line in f)
    for controllers, group in lines.items():
        if "memory" in controllers.split(","):
            return "/sys/fs/cgroup/memory" + _mounted_part("/sys/fs/cgroup/memory", group), v1
    return "/sys/fs/cgroup" + _mounted_part("/sys/fs/cgroup", lines.get("", "/")), v2


def _mounted_part(mount, group):
    """Returns the path below the mount. In a container, the mount may show the group itself as its
    root."""
    return group if os.path.isdir(mount + group) else ""
