"""Visits entities in the order of launch, and records them."""

from doppel_launch.record import RECORDER
from doppel_launch.unknown import Unknown

MAX_DEPTH = 60  # includes and groups in one another


def visit(entity, context, depth=0):
    """Records an entity and what it leads to."""
    if entity is None:
        return
    if depth > MAX_DEPTH:
        raise RecursionError("includes in a circle")
    if isinstance(entity, (list, tuple)):
        for one in entity:
            visit(one, context, depth)
        return
    if isinstance(entity, Unknown):
        visit_unknown(entity, entity.unknown_name, context)
        return
    if not hasattr(entity, "visit"):
        name = getattr(entity, "unknown_name", None)
        if name is not None:
            visit_unknown(entity, name, context)
            return
        raise TypeError(f"{entity!r} is not an action")
    entity.visit(context, depth + 1)


def visit_unknown(entity, name, context):
    """An action of a class that is not here."""
    place = getattr(entity, "place", None) or ("", 0)
    condition = getattr(entity, "condition", None)
    if condition is not None and hasattr(condition, "evaluate") and not condition.evaluate(context):
        return
    RECORDER.add("unknown", place, name=name)
