"""Events of lifecycle nodes."""

import sys
import types

from doppel_launch.unknown import unknown_attribute

HAS_STAND_INS = True


class ChangeState:
    def __init__(self, *, lifecycle_node_matcher=None, transition_id=None):
        self.transition_id = transition_id


def matches_node_name(node_name, **_named):
    return node_name


lifecycle = types.ModuleType(__name__ + ".lifecycle")
lifecycle.ChangeState = ChangeState
lifecycle.__getattr__ = unknown_attribute(lifecycle.__name__)
sys.modules[lifecycle.__name__] = lifecycle
__getattr__ = unknown_attribute(__name__)
