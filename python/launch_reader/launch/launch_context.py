"""The state of a visit: configurations, environment, what is open."""

__path__ = []  # modules below it are aliases

import os


class LaunchContext:
    """As in launch: configurations and environment with scopes, and locals."""

    def __init__(self, *, argv=None, noninteractive=False):
        self.argv = list(argv or [])
        self.noninteractive = noninteractive
        self.launch_configurations = {}
        self.environment = dict(os.environ)
        self.locals = _Locals()
        self.depth = 0  # of the visit
        self._configurations_stack = []
        self._environment_stack = []

    def push_launch_configurations(self):
        self._configurations_stack.append(dict(self.launch_configurations))

    def pop_launch_configurations(self):
        if not self._configurations_stack:
            raise RuntimeError("there are no pushed launch configurations")
        self.launch_configurations = self._configurations_stack.pop()

    def push_environment(self):
        self._environment_stack.append(dict(self.environment))

    def pop_environment(self):
        if not self._environment_stack:
            raise RuntimeError("there is no pushed environment")
        self.environment = self._environment_stack.pop()

    def extend_locals(self, values):
        self.locals.__dict__.update(values)

    def extend_globals(self, values):
        self.locals.__dict__.update(values)

    def get_locals_as_dict(self):
        return dict(self.locals.__dict__)

    def perform_substitution(self, substitution):
        return substitution.perform(self)

    def __getattr__(self, name):
        # Events, the loop of asyncio and the rest of a running launch do not exist while a file is read.
        if name.startswith("__"):
            raise AttributeError(name)
        return None


class _Locals:
    def __getattr__(self, name):
        raise AttributeError(f"this launch file has no '{name}' here")
