"""Visits entities in the order of launch, and records them."""

import contextlib

from doppel_launch.record import RECORDER, BoundError
from doppel_launch.unknown import Unknown

MAX_DEPTH = 60  # includes and groups in one another


@contextlib.contextmanager
def nested(context):
    """A `with` block for what an entity leads to. Raises RecursionError in a circle."""
    context.depth += 1
    try:
        if context.depth > MAX_DEPTH:
            raise RecursionError("includes in a circle")
        yield
    finally:
        context.depth -= 1


def each(entities, function):
    """Calls the function for each one. In a survey those after an error follow."""
    for one in entities:
        try:
            function(one)
        except (BoundError, RecursionError):
            raise
        except Exception as error:  # whatever a launch file throws
            if not RECORDER.survey:
                raise
            RECORDER.failed(error)


MAX_SKIPPED = 2  # branches that are not taken in one another


def survey_skipped(name, why, place, context, function):
    """In a survey records what a condition leaves out; its errors are not those of the file."""
    record = RECORDER.add("skipped", place, name=name, why=why)
    if not RECORDER.survey or RECORDER.skipped_depth == MAX_SKIPPED:
        return
    before = dict(context.launch_configurations), dict(context.environment), RECORDER.error
    RECORDER.skipped_depth += 1
    try:
        with RECORDER.children(record), nested(context):
            function()
    except BoundError:
        raise
    except Exception:  # its values need not exist
        pass
    finally:
        RECORDER.skipped_depth -= 1
        context.launch_configurations, context.environment, RECORDER.error = before


def visit(entity, context):
    """Records an entity and what it leads to."""
    if entity is None:
        return
    if isinstance(entity, (list, tuple)):
        each(entity, lambda one: visit(one, context))
        return
    if isinstance(entity, Unknown):
        visit_unknown(entity, entity.unknown_name, context)
        return
    if not hasattr(entity, "visit"):
        name = getattr(entity, "unknown_name", None)
        if name is not None:
            visit_unknown(entity, name, context)
            return
        raise TypeError(f"an object of {type(entity).__name__} is not an action")
    with nested(context):
        # The entities that it returns follow, as in launch.
        visit(entity.visit(context), context)


def visit_unknown(entity, name, context):
    """An action of a class that is not here."""
    place = getattr(entity, "place", None) or ("", 0)
    condition = getattr(entity, "condition", None)
    if condition is not None and hasattr(condition, "evaluate") and not condition.evaluate(context):
        return
    RECORDER.add("unknown", place, name=name)
