"""The actions of launch. Each records what it would do."""

__path__ = []  # modules below it are aliases

import os

from doppel_launch.host import absent_package
from doppel_launch.record import RECORDER, LaunchError, errors_at
from doppel_launch.texts import finite_number, split_words
from doppel_launch.unknown import unknown_attribute

from .action import Action
from .launch_description_sources import AnyLaunchDescriptionSource, LaunchDescriptionSource
from .utilities import perform_substitutions, perform_text
from .visit import visit


class DeclareLaunchArgument(Action):
    def __init__(self, name, *, default_value=None, description=None, choices=None, **named):
        super().__init__(condition=named.get("condition"))
        self.name, self.default_value, self.description = name, default_value, description or ""
        self.choices = None if choices is None else [str(one) for one in choices]

    def execute(self, context):
        given = self.name in context.launch_configurations
        known = RECORDER.arguments.get(self.name)
        if not given:
            if self.default_value is not None:
                value = perform_substitutions(context, self.default_value)
            elif RECORDER.survey:
                value = self.choices[0] if self.choices else ""
                RECORDER.assumed = True
            else:
                raise LaunchError(
                    f"the argument '{self.name}' is required, and has no default", self.place,
                    f"append {self.name}:=VALUE" + (f"  ({self.description})" if self.description else ""))
            context.launch_configurations[self.name] = value
        value = str(context.launch_configurations[self.name])
        if self.choices is not None and value not in self.choices:
            raise LaunchError(f"the argument '{self.name}' is '{value}'", self.place,
                              "one of " + ", ".join(self.choices))
        if known is None:
            RECORDER.arguments[self.name] = {
                "name": self.name, "file": self.place[0], "line": self.place[1], "value": value,
                "default": "" if self.default_value is None or given and not _is_text(self.default_value)
                else perform_substitutions(context, self.default_value),
                "description": perform_substitutions(context, self.description) if self.description else "",
                "choices": self.choices or [], "given": given}


def _is_text(value):
    return isinstance(value, str)


class SetLaunchConfiguration(Action):
    def __init__(self, name, value, **named):
        super().__init__(**named)
        self.name, self.value = name, value

    def execute(self, context):
        name = perform_substitutions(context, self.name)
        context.launch_configurations[name] = perform_substitutions(context, self.value)


class UnsetLaunchConfiguration(Action):
    def __init__(self, name, **named):
        super().__init__(**named)
        self.name = name

    def execute(self, context):
        context.launch_configurations.pop(perform_substitutions(context, self.name), None)


class ReplaceEnvironmentVariables(Action):
    def __init__(self, environment=None, **named):
        super().__init__(**named)
        self.environment = environment or {}

    def execute(self, context):
        context.environment = dict(self.environment)


class SetEnvironmentVariable(Action):
    def __init__(self, name, value, **named):
        super().__init__(**named)
        self.name, self.value = name, value

    def execute(self, context):
        name, value = perform_substitutions(context, self.name), perform_substitutions(context, self.value)
        context.environment[name] = self.changed(context.environment.get(name, ""), value)
        RECORDER.add("environment", self.place, name=name, value=context.environment[name])

    def changed(self, _before, value):
        return value


class AppendEnvironmentVariable(SetEnvironmentVariable):
    def __init__(self, name, value, prepend=False, separator=os.pathsep, **named):
        super().__init__(name, value, **named)
        self.prepend, self.separator = prepend, separator

    def changed(self, before, value):
        parts = [value, before] if self.prepend is True else [before, value]
        return self.separator.join(one for one in parts if one)


class PrependEnvironmentVariable(AppendEnvironmentVariable):
    def __init__(self, name, value, separator=os.pathsep, **named):
        super().__init__(name, value, True, separator, **named)


class UnsetEnvironmentVariable(Action):
    def __init__(self, name, **named):
        super().__init__(**named)
        self.name = name

    def execute(self, context):
        context.environment.pop(perform_substitutions(context, self.name), None)


class PushLaunchConfigurations(Action):
    def execute(self, context):
        context.push_launch_configurations()


class PopLaunchConfigurations(Action):
    def execute(self, context):
        _popped(context.pop_launch_configurations, self.place)


class ResetLaunchConfigurations(Action):
    def __init__(self, launch_configurations=None, **named):
        super().__init__(**named)
        self.values = launch_configurations or {}

    def execute(self, context):
        context.launch_configurations = _performed(context, self.values)


class PushEnvironment(Action):
    def execute(self, context):
        context.push_environment()


class PopEnvironment(Action):
    def execute(self, context):
        _popped(context.pop_environment, self.place)


def _popped(pop, place):
    try:
        pop()
    except RuntimeError as error:  # more is popped than was pushed
        raise LaunchError(str(error), place) from error


class ResetEnvironment(Action):
    def execute(self, context):
        context.environment = dict(os.environ)


def _performed(context, values):
    items = values.items() if hasattr(values, "items") else values or []
    return {perform_substitutions(context, k): perform_substitutions(context, v) for k, v in items}


class GroupAction(Action):
    def __init__(self, actions, *, scoped=True, forwarding=True, launch_configurations=None, **named):
        super().__init__(**named)
        self.actions, self.scoped, self.forwarding = actions, scoped, forwarding
        self.values = launch_configurations or {}

    def get_sub_entities(self):
        return list(self.actions)

    def subject(self, context):
        return "a group of " + str(len(list(self.actions)))

    def execute(self, context):
        values = _performed(context, self.values)
        if self.scoped:
            context.push_launch_configurations()
            context.push_environment()
            if not self.forwarding:
                context.launch_configurations = {}
        context.launch_configurations.update(values)
        visit(list(self.actions), context)
        if self.scoped:
            _popped(context.pop_environment, self.place)
            _popped(context.pop_launch_configurations, self.place)


class IncludeLaunchDescription(Action):
    def __init__(self, launch_description_source, *, launch_arguments=None, **named):
        super().__init__(condition=named.get("condition"))
        source = launch_description_source
        self.source = source if isinstance(source, LaunchDescriptionSource) else AnyLaunchDescriptionSource(source)
        self.launch_arguments = launch_arguments

    @property
    def launch_description_source(self):
        return self.source

    def subject(self, context):
        try:
            return perform_substitutions(context, self.source.path)
        except Exception:  # the path need not exist where the condition is false
            return "an include"

    def execute(self, context):
        arguments = _performed(context, self.launch_arguments)
        path = self.source.performed_path(context)
        record = RECORDER.add("include", self.place, path=path, package=absent_package(path), arguments=arguments)
        if path and not os.path.exists(path):
            record["missing"] = True
            return
        if RECORDER.skipped_depth > 0 and os.path.abspath(path) in RECORDER.files:
            return
        context.launch_configurations.update(arguments)
        locals_before = dict(context.locals.__dict__)
        with RECORDER.children(record), errors_at(self.place):
            self.source.visit(context)
        context.locals.__dict__.clear()
        context.locals.__dict__.update(locals_before)


class OpaqueFunction(Action):
    def __init__(self, *, function, args=None, kwargs=None, **named):
        super().__init__(**named)
        self.function, self.args, self.kwargs = function, list(args or []), dict(kwargs or {})

    def execute(self, context):
        visit(self.function(context, *self.args, **self.kwargs), context)


class OpaqueCoroutine(Action):
    def __init__(self, *, coroutine, **named):
        super().__init__(condition=named.get("condition"))
        self.name = getattr(coroutine, "__name__", "a coroutine")

    def execute(self, context):
        RECORDER.add("unknown", self.place, name=f"OpaqueCoroutine of {self.name}")


class ForEach(Action):
    def __init__(self, values, *, function, **named):
        super().__init__(**named)
        self.values, self.function = values, function

    def execute(self, context):
        import yaml

        for text in perform_substitutions(context, self.values).split(";"):
            if text.strip():
                visit(self.function(**yaml.safe_load(text)), context)


class ForLoop(Action):
    def __init__(self, length, *, function, name="i", **named):
        super().__init__(**named)
        self.length, self.function = length, function

    def execute(self, context):
        for i in range(int(perform_substitutions(context, self.length))):
            visit(self.function(i), context)


class LogInfo(Action):
    def __init__(self, *, msg, **named):
        super().__init__(condition=named.get("condition"))
        self.msg = msg

    def execute(self, context):
        RECORDER.add("log", self.place, text=perform_substitutions(context, self.msg))


Log = LogWarning = LogError = LogDebug = LogInfo


class TimerAction(Action):
    def __init__(self, *, period, actions, **named):
        super().__init__(condition=named.get("condition"))
        self.period, self.actions = period, actions

    def subject(self, context):
        return "a timer"

    def execute(self, context):
        period = self.period if isinstance(self.period, (int, float)) else perform_substitutions(context, self.period)
        record = RECORDER.add("timer", self.place, period=finite_number(period, self.place))
        with RECORDER.children(record):
            visit(list(self.actions), context)


class RegisterEventHandler(Action):
    def __init__(self, event_handler, **named):
        super().__init__(**named)
        self.event_handler = event_handler

    def subject(self, context):
        return "an event handler"

    def execute(self, context):
        handler = self.event_handler
        if not hasattr(handler, "entities_of"):
            RECORDER.add("unknown", self.place, name=getattr(handler, "unknown_name", type(handler).__name__))
            return
        target = getattr(handler, "target_action", None)
        record = RECORDER.add("event", self.place, event=handler.event_name)
        for one in target if isinstance(target, (list, tuple)) else [target]:
            if getattr(one, "record", None) is not None:
                record.setdefault("after", []).append(one.record)
        with RECORDER.children(record):
            visit(handler.entities_of(context), context)


class UnregisterEventHandler(Action):
    def __init__(self, event_handler, **named):
        super().__init__(condition=named.get("condition"))


class EmitEvent(Action):
    def __init__(self, *, event, **named):
        super().__init__(condition=named.get("condition"))
        self.event = event

    def execute(self, context):
        name = getattr(self.event, "unknown_name", type(self.event).__name__)
        RECORDER.add("emit", self.place, name=name)


class Shutdown(Action):
    def __init__(self, *, reason="", **named):
        super().__init__(condition=named.get("condition"))
        self.reason = reason

    # Event handlers call it with an event and the context.
    def __call__(self, *_arguments):
        return self

    def execute(self, context):
        RECORDER.add("shutdown", self.place, reason=perform_substitutions(context, self.reason or ""))


ShutdownAction = Shutdown


class ExecuteLocal(Action):
    def __init__(self, *, process_description=None, shell=False, sigterm_timeout=None, sigkill_timeout=None,
                 emulate_tty=None, output="log", output_format=None, log_cmd=False, on_exit=None, respawn=False,
                 respawn_delay=None, respawn_max_retries=-1, prefix=None, **named):
        super().__init__(condition=named.get("condition"))
        self.process_description = process_description
        self.shell, self.on_exit, self.respawn = shell, on_exit, respawn

    def execute(self, context):
        if self.process_description is not None:
            self.process_description.record_into(self, context)
        self.after_record(context)

    def after_record(self, context):
        """on_exit of the process."""
        entities = self.on_exit
        if entities is None or self.record is None:
            return
        if callable(entities) and not isinstance(entities, Action):
            RECORDER.add("unknown", self.place, name="on_exit of " + self.record.get("name", "a process"))
            return
        if isinstance(entities, Shutdown):
            self.record["required"] = True
            return
        record = RECORDER.add("event", self.place, event="exit", after=[self.record])
        with RECORDER.children(record):
            visit(entities, context)


class ExecuteProcess(ExecuteLocal):
    def __init__(self, *, cmd, name=None, cwd=None, env=None, additional_env=None, **named):
        super().__init__(**named)
        self.cmd, self.name, self.cwd = list(cmd), name, cwd
        self.env, self.additional_env = env, additional_env

    def subject(self, context):
        try:
            return " ".join(self.words(context))
        except Exception:  # a part of the command may not exist where the condition is false
            return "a process"

    def words(self, context):
        words = [perform_substitutions(context, one) for one in self.cmd]
        if self.shell:
            return split_words(" ".join(words), self.place)
        return [one for one in words if one != ""]

    def execute(self, context):
        self.record = RECORDER.add(
            "process", self.place, words=self.words(context), shell=self.shell,
            name=perform_text(context, self.name), cwd=perform_text(context, self.cwd),
            environment=changed_environment(context, self.env, self.additional_env))
        self.after_record(context)


def changed_environment(context, env=None, additional_env=None):
    """The variables of a process that differ from those of this one."""
    out = {k: v for k, v in context.environment.items() if os.environ.get(k) != v}
    for values in (env, additional_env):
        out.update(_performed(context, values))
    return out


__getattr__ = unknown_attribute(__name__)
